"""The tree of symbols: paths, types, bytes there and back."""

from __future__ import annotations

import ctypes
import math
from typing import Any

import numpy as np
import pytest

from cnc_core.bridges.symbols.hli_symbols import HliSymbols
from cnc_core.bridges.symbols.kinds import (
    Array,
    Member,
    Number,
    Record,
    Text,
    decode,
    encode,
)
from cnc_core.bridges.symbols.listing import everything, leaves
from cnc_core.bridges.symbols.ownership import plc_leaves, writable
from cnc_core.bridges.symbols.place import Place, parts_of
from cnc_core.bridges.symbols.plc_symbols import PlcSymbols
from cnc_core.bridges.symbols.ranges import inside, singles
from hli import layout
from hli.members import member_at
from hli.symbol import SymbolError
from plc_client.listing import described
from plc_client.program import Program
from plc_client.task import task

HLI = HliSymbols(2, 3)


def found(path: str) -> Place:
    """The symbol behind a path of the HLI."""
    return HLI.find(parts_of(path), path)


def test_every_single_value_stands_where_the_layout_has_it() -> None:
    """Another walk over the layout, by offsets, gives the same paths."""
    roots = [p for p in HLI.roots() if "gpAx" in p.path or "gpPform" in p.path]
    for root in roots:
        for leaf in leaves(root):
            member = member_at(leaf.offset)
            if member is None:  # a fill
                continue
            plain = leaf.path.removeprefix("HLI_Global_Variables.")
            assert member.path == plain.replace("^", "")
            assert leaf.size == ctypes.sizeof(member.type)


@pytest.mark.parametrize(
    "path",
    [
        "gpCh[2]^.head.channel_nr",
        "gpCh[-1]^.head.channel_nr",
        "gpCh^.head",
        "gpCh[0,1]^.head",
        "gpCh[0]^.head[0]",
        "gpCh[0]^.bahn_state.coord_r[32]",
        "gpCh[0]^.bahn_state.coord_r[x]",
        "gpAx[0]^.head.none",
        "HLI_Global_Variables",
        "gpCh[0]^.head.channel_nr.more",
        "[0]",
        "",
        "gpCh[0]" + ".head" * 300,
    ],
)
def test_what_names_nothing_is_refused(path: str) -> None:
    """With the path in the error's text, or that it is too long."""
    with pytest.raises(SymbolError):
        found(path)


def test_aliases_name_the_same_place() -> None:
    """Old spellings of members."""
    unit = "gpCh[0]^.bahn_mc_control.insert_cmd"
    a, b = found(f"{unit}.semaphor_rw"), found(f"{unit}.command_semaphor_rw")
    assert (a.path, a.offset) == (b.path, b.offset)
    axis = "gpCh[0]^.bahn_state.coord_r[1]"
    c, d = found(f"{axis}.log_achs_nr_r"), found(f"{axis}.log_axis_nr_r")
    assert (c.path, c.offset) == (d.path, d.offset)


def test_the_plc_owns_what_the_reference_says() -> None:
    """Commands, requests, external variables; no status."""
    for path in (
        "gpCh[0]^.bahn_mc_control.feedhold.command_w",
        "gpCh[1]^.contour_lookahead.request.start_position",
        "gpVEGlobal^[7]",
        "gpCh[0]^.hb_mc_control.key[11].command_w.direction",
    ):
        assert writable(found(path)), path
    for path in (
        "gpCh[0]^.bahn_state",
        "gpCh[0]^.bahn_mc_control.feedhold.state_r",
        "gpCh[0]^.contour_lookahead.response",
        "gNrCh",
    ):
        assert not writable(found(path)), path


def test_semaphores_are_set_last() -> None:
    """They tell the CNC that all else is there."""
    unit = found("gpCh[0]^.channel_mc_control.mode_and_state")
    names = [p.path.rpartition(".")[2] for p in plc_leaves(unit)]
    assert names[-2:] == ["request_semaphor_rw", "command_semaphor_rw"]
    assert "parameter" in names


def test_bytes_lead_back_to_symbols() -> None:
    """The smallest symbol around them; a number that is cut is none."""
    place = found("gpCh[1]^.bahn_state.coord_r[3].act_position_r")
    assert inside(HLI.roots(), place.offset, 4) == place
    ve = found("gpVEGlobal^")
    slice_ = inside(HLI.roots(), ve.offset + 8, 12)
    assert slice_ is not None
    parts = singles(slice_, ve.offset + 8, 12)
    assert parts is not None
    assert [p.path[-3:] for p in parts] == ["[2]", "[3]", "[4]"]
    assert singles(slice_, ve.offset + 9, 4) is None
    assert inside(HLI.roots(), 1 << 30, 4) is None


RECORD = Record(
    "R",
    24,
    {
        "A": Member("a", Number("INT"), 0),
        "T": Member("t", Text(5), 2),
        "F": Member("f", Array(Number("REAL"), ((1, 2),)), 8),
        "B0": Member("b0", Number("BIT"), 16, 0),
        "B3": Member("b3", Number("BIT"), 16, 3),
    },
)


def test_values_go_to_bytes_and_back() -> None:
    """A record with text, array and bits."""
    value = {"a": -3, "t": "Grün", "f": [0.5, 1.5], "b0": False, "b3": True}
    data = encode(RECORD, value)
    assert len(data) == 24
    assert data[16] == 0b1000
    back = decode(RECORD, data)
    assert {k: back[k] for k in ("a", "t", "f")} == {
        k: value[k] for k in ("a", "t", "f")
    }


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (Number("INT"), 1 << 40),
        (Number("UDINT"), -1),
        (Number("LREAL"), "text"),
        (Number("REAL"), 1e300),
        (Number("DINT"), math.nan),
        (Number("LINT"), math.inf),
        (Text(3), "longer than that"),
        (Text(3, wide=True), None),
        (Array(Number("INT"), ((0, 3),)), [1, 2, 3, 4, 5]),
        (Array(Number("INT"), ((0, 3),)), "no list"),
        (RECORD, {"a": {}, "none": 1}),
    ],
)
def test_values_that_do_not_fit_keep_the_size(kind: Any, value: Any) -> None:
    """A PLC in Python may put anything into its variables."""
    assert len(encode(kind, value)) == kind.size


class Recursive:
    """It holds itself."""

    def __init__(self) -> None:
        self.inner: Any = self
        self.x = 1


@task
class Odd:
    """What no client can read is left out."""

    def __init__(self) -> None:
        self.x = 1.5
        self.big = np.zeros((2, 2), np.int16)
        self.words = ["a", "b"]
        self.mixed = [1, "b"]
        self.empty: list[int] = []
        self.nothing = None
        self.loop = Recursive()
        self.function = len
        self.numpy = np.float32(2)

    def cyclic(self) -> None:
        pass


def test_a_python_task_is_described_by_what_it_holds() -> None:
    """Numbers and arrays of numpy, too; recursion ends."""
    symbols = PlcSymbols(described([Program.of(Odd)]))
    names = [p.path for p in everything(symbols.roots())]
    assert "Odd.x" in names
    assert "Odd.loop.inner.inner.x" in names
    for left_out in ("words", "mixed", "empty", "nothing", "function"):
        assert f"Odd.{left_out}" not in names
    big = symbols.find(parts_of("Odd.big[1,1]"), "Odd.big[1,1]")
    assert (big.kind, big.path) == (Number("INT"), "Odd.big[1,1]")
    kind = symbols.find(["Odd", "numpy"], "Odd.numpy").kind
    assert kind == Number("REAL")


def test_a_description_that_recurs_does_not_hang() -> None:
    """Types that hold themselves end; a foreign PLC may tell anything."""
    told = {
        "types": [["t", "Node", 8, {"next": [0, 0, -1]}], ["p", "x"]],
        "roots": [["A", 0], ["B", 1]],
    }
    symbols = PlcSymbols(told)
    assert "B" not in symbols
    assert len(list(everything(symbols.roots()))) < 100


def test_the_layouts_lists_stay_in_their_bounds() -> None:
    """An axis behind the last one is NULL, also in the list."""
    paths = [p.path for p in HLI.roots()]
    assert sum("gpAx[" in path for path in paths) == 3
    assert sum("gpCh[" in path for path in paths) == 2
    assert len(layout.HLI_SEGMENT._fields_) == 8
