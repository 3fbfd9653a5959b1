"""Each dependency says the lowest version that it takes, so that one can try it."""

from __future__ import annotations

import tomllib

import pytest

import lowest_bounds
from support.paths import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_every_requirement_has_a_lower_bound() -> None:
    """None is left out of those that are tried, with those of the extras named."""
    project = PROJECT["project"]
    found = lowest_bounds.lowest(project, "test")
    named = lowest_bounds.bounds(project["dependencies"])
    assert named.items() <= found.items()
    assert {"pytest", "matplotlib", "starlette", "asyncua"} <= set(found)
    assert found["numpy"] == "1.26"
    tools = lowest_bounds.bounds(PROJECT["build-system"]["requires"])
    assert set(tools) == {"setuptools", "cffi"}


@pytest.mark.parametrize("text", ["numpy", "numpy==1.26", "numpy<3"])
def test_a_requirement_without_one_is_refused(text: str) -> None:
    """It would be tried in its newest version without a word."""
    with pytest.raises(ValueError, match=r"numpy.* no lower bound"):
        lowest_bounds.bounds([text])
