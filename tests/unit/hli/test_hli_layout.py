"""The layout's rules, the reference's sizes, and that C and Python agree on every byte."""

import ctypes
import subprocess

import pytest

from hli import export, layout

SIZES = {
    "MC_CONTROL_BOOL_UNIT": 8,
    "MC_CONTROL_UNS16_UNIT": 8,
    "MC_CONTROL_SGN32_UNIT": 16,
    "MC_CONTROL_UNS32_UNIT": 16,
    "MC_CONTROL_LREAL_UNIT": 32,
    "MC_WATCHDOG_UNIT": 8,
    "HLI_PROC_TRANS_TO_MODE_STATE": 328,
    "MC_CONTROL_MCM_MODE_STATE_UNIT": 680,
    "MC_CONTROL_INSERT_CMD_UNIT": 168,
    "TECHNO_UNIT_CH": 48,
    "TECHNO_UNIT_AX": 48,
    "HLI_M_H_PROZESS": 32,
    "HLI_S_PROZESS": 40,
    "HLI_T_PROZESS": 40,
    "HLI_HEAD_CHANNEL": 80,
    "HLI_HEAD_AXIS": 16,
    "HLI_COORD": 88,
    "HLI_ERROR_KOPF": 104,
    "HLI_ERROR_RUMPF": 848,
    "HLI_RUMPF_NC_PROG": 544,
    "MC_ERROR": 960,
    "HLI_CONTOUR_LOOKAHEAD_BLOCK": 72,
    "HLI_CONTOUR_LOOKAHEAD_REQUEST": 16,
    "HLI_CONTOUR_LOOKAHEAD_STATE": 16,
    "HLI_SEGMENT_HEAD": 256,
}


def test_layout_has_no_implicit_padding() -> None:
    """verify() accepts the layout: every gap is an explicit fill."""
    layout.verify()


@pytest.mark.parametrize(("name", "size"), SIZES.items())
def test_structure_has_the_size_of_the_reference(name: str, size: int) -> None:
    """Sizes of the reference's table (section 8)."""
    assert ctypes.sizeof(getattr(layout, name)) == size


@pytest.mark.parametrize("cls", layout.structures(), ids=lambda c: c.__name__)
def test_every_member_stands_at_a_multiple_of_its_alignment(
    cls: type[ctypes.Structure],
) -> None:
    """Natural and packed layouts agree."""
    for name, ctype in cls._fields_:  # type: ignore[misc]
        base, _ = layout.element_type(ctype)
        assert getattr(cls, name).offset % ctypes.alignment(base) == 0, name


@pytest.mark.parametrize(
    "name",
    [
        f.__name__
        for f in layout.structures()
        if f.__name__.startswith("HLI_SIDE_")
    ],
)
def test_sidecar_parts_fill_whole_cache_lines(name: str) -> None:
    """One writer per cache line."""
    structure = getattr(layout, name)
    if structure is layout.HLI_SIDE_TECHNO:  # the PLC's lines, then the CNC's
        assert structure.shown.offset == 0
        assert structure.again.offset == 192
        assert ctypes.sizeof(structure) == 384
    else:
        assert ctypes.sizeof(structure) == 64


def test_c_header_compiles_without_warnings_and_its_assertions_hold(
    tmp_path,
) -> None:
    """gcc accepts every offset and size the header asserts."""
    source = tmp_path / "check.c"
    source.write_text(export.c_header() + "int main(void) { return 0; }\n")
    command = [
        "gcc",
        "-std=c11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-fsyntax-only",
        str(source),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_hash_depends_on_the_layout_alone(monkeypatch) -> None:
    """The hash is stable and changes with the description."""
    of_layout = export.layout_hash.__wrapped__  # computed once a process
    before = of_layout()
    assert before == export.layout_hash() == of_layout()
    assert len(before) == 32
    text = layout.describe()
    monkeypatch.setattr(layout, "describe", lambda: text + "x")
    assert of_layout() != before
