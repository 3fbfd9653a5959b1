"""Axis limits with which no motion ever ends, and numbers that belong to no
key, are refused with a reason.
"""

from __future__ import annotations

import time

import pytest

from cnc_core.config import parse_config
from cnc_core.config.toml import LONG_KEY, toml_of
from cnc_core.errors import CncError, ConfigError


@pytest.mark.parametrize("key", ["v_max_mm_s", "a_max_mm_s2"])
def test_limits_that_end_no_motion(key: str) -> None:
    """1e-300 mm/s is a number, but a millimetre would take longer than the
    universe: the key is named.
    """
    with pytest.raises(CncError, match=f"axes.X.{key}"):
        parse_config(f"[axes.X]\n{key} = 1e-300\n[axes.Y]\n[axes.Z]\n")


@pytest.mark.parametrize("jerk", ["1e-6", "0.01", "0.999"])
def test_a_jerk_limit_below_rounding(jerk: str) -> None:
    """Over the minutes such a motion lasts positions round to more jerk than
    that (61 times 0.01 mm/s3): refused.
    """
    with pytest.raises(
        CncError, match=r"axes\.X.*j_max_mm_s3 .* below 1 mm/s3"
    ):
        parse_config(f"[axes.X]\nj_max_mm_s3 = {jerk}\n[axes.Y]\n[axes.Z]\n")


@pytest.mark.parametrize(
    "key",
    ["a." * 32000 + "b = 1", "[" + "'a' . " * 200 + "b]", "x={" + "a." * 200],
)
def test_a_key_of_too_many_parts(key: str) -> None:
    """It is refused with its line before it takes any memory."""
    with pytest.raises(ConfigError, match="nested too deeply") as caught:
        parse_config(f"# a\n{key}\n")
    assert caught.value.place is not None
    assert caught.value.place.line == 2


def test_dots_that_are_no_key() -> None:
    """Texts and comments may have many; a key may have a hundred parts."""
    dotted = ".".join(["a"] * 100)
    text = (
        f'{dotted} = "{"1." * 300}, b" # {"a." * 300}\n[x]\n"a.b" = [1.5, 2.5]'
    )
    assert toml_of(text)["x"] == {"a.b": [1.5, 2.5]}


def test_a_text_without_an_end_is_looked_through_once() -> None:
    """Half a megabyte of what may begin a key is refused in no time."""
    for text in (",a" * 250_000, ',"\\' * 170_000, ",'" * 250_000):
        began = time.process_time()
        assert not LONG_KEY.search(text * 2)
        assert time.process_time() - began < 5.0


def test_same_logical_axis_numbers() -> None:
    """What concerns the whole cell is told without an empty key."""
    with pytest.raises(CncError, match="902001: logical axis numbers"):
        parse_config("[axes.X]\nid = 2\n[axes.Y]\nid = 2\n[axes.Z]\n")


def test_an_unknown_key_is_told_with_what_there_is() -> None:
    """A slip of the pen gets the key that was meant, another word all keys."""
    part = "[axes.X]\n[axes.Y]\n[axes.Z]\n[inputs.Door.shut]\n"
    with pytest.raises(
        CncError, match="stat: unknown key; did you mean 'start"
    ):
        parse_config(part + "stat = true\n")
    with pytest.raises(CncError, match="initial: unknown key; known: start, "):
        parse_config(part + "initial = true\n")
