"""``[channels.NAME]``: several channels in one cell."""

from __future__ import annotations

import json

import pytest

from cnc_core.config import CellConfig, parse_config, setups_of
from cnc_core.config.reading import config_of, config_text
from cnc_core.errors import CncError

TWO = """
[channel]
lookahead_blocks = 50
[tools.1]
radius_mm = 4.0
[external.SHARED]
type = "SGN32"
scope = "global"
[channels.mill]
fct_enable = "FCT_LOOK_AHEAD_CUSTOM"
[channels.mill.axes.X]
[channels.mill.axes.Y]
[channels.mill.spindles.S]
id = 20
[channels.loader]
lookahead_blocks = 30
program = "load.nc"
[channels.loader.axes.X]
v_max_mm_s = 500.0
[channels.loader.axes.Z]
id = 9
[channels.loader.tools.2]
radius_mm = 1.0
"""


def test_each_channel_sees_its_part_of_the_cell() -> None:
    """What stands at the top holds for all channels, a channel's table replaces
    or extends it; axes count through the cell, spindles behind them.
    """
    mill, loader = setups_of(parse_config(TWO))
    assert (mill.place.index, mill.place.name, mill.place.axis_base) == (
        0,
        "mill",
        0,
    )
    assert (loader.place.index, loader.place.axis_base) == (1, 3)
    assert mill.cell.axis_ids == (1, 2)
    assert loader.cell.axis_ids == (4, 9)
    assert (mill.cell.channel.window, loader.cell.channel.lookahead_blocks) == (
        50,
        30,
    )
    assert list(mill.cell.tools) == ["1"]
    assert list(loader.cell.tools) == ["1", "2"]
    assert loader.cell.axis_values("v_max_mm_s").tolist() == [500.0, 300.0]
    assert loader.program == "load.nc"
    for setup in (mill, loader):
        assert setup.cell.externals["SHARED"].number == 1


def test_a_cell_with_one_channel_is_as_it_was() -> None:
    """Without ``[channels]`` the cell itself is its only channel."""
    cell = parse_config("[axes.X]\n[axes.Y]\n")
    (setup,) = setups_of(cell)
    assert setup.cell is cell
    assert str(setup.place) == "the channel"


def test_it_goes_between_processes() -> None:
    """The text that the CNC process reads holds the same channels."""
    values = json.loads(config_text(parse_config(TWO)))
    again = config_of(values)
    assert [s.place for s in setups_of(again)] == [
        s.place for s in setups_of(parse_config(TWO))
    ]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        (
            "[channels.a.axes.X]\nid = 3\n[channels.b.axes.Y]\nid = 3\n",
            3,
            "belongs to axis X of channel a already",
        ),
        (
            "".join(f"[channels.c{i}.axes.X]\n" for i in range(13)),
            1,
            "13 tables, the HLI has room for 12",
        ),
        ("[channels.a.axes.X]\n[channels.a.axes.X]\n", 2, "twice"),
        ("[channels.a.axes.X]\n[channels.A.axes.X]\n", 0, "only in capitals"),
        ("[channels.a]\nservise = 'x'\n[channels.a.axes.X]\n", 2, "'service'"),
        (
            "[channels.a.axes.X]\nv_mx_mm_s = 1.0\n",
            2,
            "channels.a.axes.X.v_mx_mm_s: unknown key; did you mean 'v_max",
        ),
        ("[axes.X]\n[channels.a.axes.X]\n", 1, "[channels.NAME.axes]"),
        ("[channels.a]\nprogram = 'a.nc'\n", 0, "axes: Field required"),
        (
            "[channels.a.axes.X]\n[channels.a.external.N]\nscope = 'global'\n"
            "type = 'SGN32'\n",
            2,
            "of all channels",
        ),
        (
            "[channels.a.axes.X]\n[channels.a.zero_offsets.1]\nY = 1.0\n",
            1,
            "has no axis 'Y'",
        ),
        ("[channels.'a b'.axes.X]\n", 0, "channel name 'a b'"),
        (
            "".join(
                f"[channels.c{i}.axes.{n}]\n"
                for i in range(8)
                for n in "XYZUVWABC"
            ),
            1,
            "72 axes and spindles, the HLI has room for 64",
        ),
    ],
)
def test_what_is_wrong_is_told_with_its_place(
    text: str, line: int, said: str
) -> None:
    """A wrong channel names the table, the line and what to do."""
    with pytest.raises(CncError) as told:
        parse_config(text, "cell.toml")
    assert said in told.value.text
    assert told.value.place.line == line


def test_what_takes_one_channel_refuses_several() -> None:
    """Never the first channel for all: whoever asks the whole cell for axes is
    refused by name.
    """
    cell: CellConfig = parse_config(TWO)
    for ask in (
        lambda: cell.axis_names,
        lambda: cell.axis_ids,
        lambda: cell.axis_values("start_mm"),
        cell.program_machine,
    ):
        with pytest.raises(CncError, match="mill, loader"):
            ask()


def test_numbers_are_keys_of_a_dict() -> None:
    """``{50: "MVS_SVS"}`` of Python is ``50 = "MVS_SVS"`` of a file."""
    by_number = config_of({"channel": {"m_synch": {50: "MVS_SVS"}}})
    by_text = config_of({"channel": {"m_synch": {"50": "MVS_SVS"}}})
    assert by_number == by_text


def test_a_cell_is_no_number() -> None:
    """The text names what a cell is."""
    with pytest.raises(CncError, match="a path, a dict or a CellConfig"):
        config_of(5)  # type: ignore[arg-type]


def test_a_synchronisation_without_a_neighbour_lists_all() -> None:
    """``FOO`` was told to be a misspelt MOS."""
    with pytest.raises(CncError, match="'FOO'; NO_SYNCH, MOS"):
        config_of({"channel": {"m_synch": {"50": "FOO"}}})
