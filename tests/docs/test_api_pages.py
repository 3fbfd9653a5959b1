"""The API pages have every public name, with a docstring."""

from __future__ import annotations

import importlib
import inspect
import re

import pytest

from support.paths import ROOT

TEXT = "".join(
    page.read_text()
    for page in sorted((ROOT / "docs" / "reference" / "api").glob("*.rst"))
)
WHOLE = re.findall(r"^\.\. automodule:: (\S+)\n +:members:", TEXT, re.M)


@pytest.mark.parametrize("package", ["cnc_core", "plc_client", "hli"])
def test_every_public_name_is_told(package: str) -> None:
    """By itself, or by a module that is shown whole."""
    module = importlib.import_module(package)
    whole = [importlib.import_module(name) for name in WHOLE]
    for name in module.__all__:
        value = getattr(module, name)
        own = re.search(rf"^\.\. auto\w+:: (\S+\.)?{name}$", TEXT, re.M)
        within = any(vars(one).get(name) is value for one in whole)
        assert own or within, f"{package}.{name}"
        if inspect.isclass(value) or inspect.isfunction(value):
            assert inspect.getdoc(value), f"{package}.{name}"
