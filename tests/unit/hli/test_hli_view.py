"""Typed views: names, types, ranges, arrays."""

from collections.abc import Iterator

import numpy as np
import pytest

import hli
from hli import HliNotConfigured, layout
from hli.areas import Areas
from hli.symbol import SymbolError
from hli.view import BLOCK_DTYPE, overlay
from support.fake_cnc import unique_name

pytestmark = pytest.mark.sanitize("hli")


@pytest.fixture
def areas() -> Iterator[Areas]:
    """Areas over a fresh segment with one channel and three axes."""
    with hli.create(unique_name(), 1, 3) as segment:
        yield Areas(segment)


def test_pointers_of_configured_areas_only(areas: Areas) -> None:
    """Unconfigured channels and axes are None, as the manual's NULL pointers."""
    assert (areas.gNrCh, areas.gNrAx) == (1, 3)
    assert (len(areas.gpCh), len(areas.gpAx), len(areas.gpVECh)) == (12, 64, 12)
    assert areas.gpCh[0] is not None
    assert [area is None for area in areas.gpCh] == [False] + 11 * [True]
    with pytest.raises(
        HliNotConfigured,
        match=r"channel 1 .*: gpCh\[1\] is NULL; the CNC has gpCh\[0..0\]",
    ):
        _ = areas.gpCh[1]
    with pytest.raises(IndexError, match=r"gpCh\[12\]: the index runs 0..11"):
        _ = areas.gpCh[12]
    with pytest.raises(IndexError, match=r"gpCh\[-1\]"):
        _ = areas.gpCh[-1]
    assert areas.gpAx[2] is not None
    assert list(areas.gpAx[2:5]) == [areas.gpAx[2], None, None]


def test_writing_reaches_the_memory_and_other_attachments(areas: Areas) -> None:
    """The view is the memory: another mapping sees the value."""
    other = Areas(hli.attach(areas.segment.name))
    areas.gpCh[0].contour_lookahead.request.start_position = 7.25
    areas.gpCh[0].bahn_mc_control.override.command_w = 800
    areas.gpAx[1].head.log_ax_n_r = 4
    assert other.gpCh[0].contour_lookahead.request.start_position == 7.25
    assert other.gpCh[0].bahn_mc_control.override.command_w == 800
    assert other.gpAx[1].head.log_ax_n_r == 4
    other.segment.close()


def test_sub_views_are_cached(areas: Areas) -> None:
    """The same path gives the same object."""
    assert areas.gpCh[0].bahn_state is areas.gpCh[0].bahn_state


def test_bool_and_string_members_have_python_types(areas: Areas) -> None:
    """BOOL is bool, STRING is str."""
    state = areas.gpCh[0].bahn_state
    state.program_end_r = 1
    assert state.program_end_r is True
    state.prog_name_r = "teil_ä.nc"
    assert state.prog_name_r == "teil_ä.nc"
    with pytest.raises(ValueError, match=r"prog_name_r.*260"):
        state.prog_name_r = "x" * 260


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("overide", "override"), ("feedhod", "feedhold"), ("feed", "feedhold")],
)
def test_unknown_name_tells_the_nearest(
    areas: Areas, wrong: str, right: str
) -> None:
    """For reading and for writing; nothing is created silently."""
    control = areas.gpCh[0].bahn_mc_control
    with pytest.raises(AttributeError, match=rf"{wrong}.*{right}"):
        getattr(control, wrong)
    with pytest.raises(AttributeError, match=rf"{wrong}.*{right}"):
        setattr(control, wrong, 1)


@pytest.mark.parametrize("value", [-1, 65536, 70000])
def test_numbers_out_of_range_raise(areas: Areas, value: int) -> None:
    """No silent wrap; the member keeps its value."""
    unit = areas.gpCh[0].bahn_mc_control.override
    unit.command_w = 1000
    with pytest.raises(OverflowError, match="command_w"):
        unit.command_w = value
    assert unit.command_w == 1000


@pytest.mark.parametrize("value", [1.5, "1", None, float("nan")])
def test_values_of_wrong_type_raise(areas: Areas, value: object) -> None:
    """TypeError with the member's name."""
    with pytest.raises(TypeError, match="command_w"):
        areas.gpCh[0].bahn_mc_control.override.command_w = value


def test_bool_takes_truth_values_only(areas: Areas) -> None:
    """2 is no BOOL."""
    with pytest.raises(TypeError, match="enable_w"):
        areas.gpCh[0].bahn_mc_control.override.enable_w = 2
    with pytest.raises(TypeError, match="semaphor_rw"):
        areas.gpCh[0].contour_lookahead.semaphor_rw = 2


def test_numpy_numbers_are_numbers(areas: Areas) -> None:
    """np.int64, np.float64, np.bool_ are taken."""
    unit = areas.gpCh[0].bahn_mc_control.override
    unit.command_w = np.float64(500.0)
    unit.enable_w = np.True_
    assert (unit.command_w, unit.enable_w) == (500, True)


@pytest.mark.parametrize("alias", ["dist_prog_start_high", "stop_conditions_r"])
def test_aliases_reach_the_same_memory(areas: Areas, alias: str) -> None:
    """Old spellings of the manual."""
    state = areas.gpCh[0].bahn_state
    setattr(state, alias, 3)
    assert getattr(state, layout.ALIASES[alias]) == 3


def test_alias_of_a_member_belongs_to_its_unit(areas: Areas) -> None:
    """insert_cmd.semaphor_rw is its command_semaphor_rw; feed_hold is feedhold."""
    control = areas.gpCh[0].bahn_mc_control
    control.insert_cmd.semaphor_rw = True
    assert control.insert_cmd.command_semaphor_rw is True
    assert control.feed_hold is control.feedhold


def test_arrays_of_numbers_check_index_and_range(areas: Areas) -> None:
    """Index and value errors name the array."""
    g_functions = areas.gpCh[0].bahn_state.g_function_r
    g_functions[3] = 54
    assert list(g_functions)[3] == 54
    assert g_functions[2:5] == [0, 54, 0]
    assert g_functions.as_array()[3] == 54
    with pytest.raises(IndexError, match=r"g_function_r\[16\].*0\.\.15"):
        g_functions[16] = 1
    with pytest.raises(OverflowError, match="g_function_r"):
        g_functions[0] = 70000


def test_external_variables_are_arrays_of_udint(areas: Areas) -> None:
    """gpVECh[i][k] as in the manual, .value[k] as in the layout."""
    areas.gpVECh[0][6] = 77
    assert areas.gpVECh[0].value[6] == 77
    areas.gpVEGlobal[0] = 1
    assert areas.gpVEGlobal[0] == 1


def test_answer_is_one_numpy_array_over_the_memory(areas: Areas) -> None:
    """No copy, the layout's fields."""
    response = areas.gpCh[0].contour_lookahead.response
    array = response.as_array()
    assert (array.dtype, array.shape) == (BLOCK_DTYPE, (128,))
    response.block[5].length = 2.5
    assert array["length"][5] == 2.5


def test_structures_are_copied_as_a_whole(areas: Areas) -> None:
    """ST's structure assignment; another type is refused."""
    unit = areas.gpCh[0].contour_lookahead
    unit.request = layout.HLI_CONTOUR_LOOKAHEAD_REQUEST(1.0, 2.0)
    assert (unit.request.start_position, unit.request.length) == (1.0, 2.0)
    with pytest.raises(TypeError, match="request"):
        unit.request = (1.0, 2.0)


def test_technology_data_is_read_through_a_typed_overlay(areas: Areas) -> None:
    """The PLC's typed pointer on attribut_r.data."""
    unit = areas.gpCh[0].techno_unit_std_sync[0]
    payload = overlay(unit.attribut_r.data, layout.HLI_M_H_PROZESS)
    payload.nr = 30
    assert unit.attribut_r.data[0] == 30


def test_views_survive_the_closing_of_their_segment() -> None:
    """Memory stays mapped while a view looks at it."""
    with hli.create(unique_name()) as segment:
        state = Areas(segment).gpCh[0].bahn_state
    state.dist_prog_start = 4.0
    assert state.dist_prog_start == 4.0


def test_every_member_of_every_structure_has_its_property(areas: Areas) -> None:
    """Nothing of the layout is missing in the views."""
    seen = set()

    def walk(view: object) -> None:
        for name in type(view)._names:  # type: ignore[attr-defined]
            value = getattr(view, name)
            parts = value[:1] if isinstance(value, tuple) else (value,)
            for part in parts:
                if hasattr(type(part), "_names") and type(part) not in seen:
                    seen.add(type(part))
                    walk(part)

    walk(areas.root)
    for cls in seen:
        assert set(cls._names) >= {
            n
            for n, _ in getattr(layout, cls.__name__)._fields_
            if not n.startswith("fill_")
        }
    assert len(seen) > 40


def test_parts_and_members_cannot_be_deleted(areas: Areas) -> None:
    """A ``del`` would only lose the view."""
    for name in ("bahn_state", "contour_lookahead"):
        with pytest.raises(
            AttributeError,
            match=f"{name}: what lies in the memory cannot be deleted",
        ):
            delattr(areas.gpCh[0], name)
    with pytest.raises(AttributeError, match="cannot be deleted"):
        del areas.gpCh[0].bahn_mc_control.override.command_w


@pytest.mark.parametrize(
    ("name", "right"),
    [
        ("gpch", "did you mean hli.gpCh?"),
        ("gpChannel", "did you mean hli.gpCh?"),
        ("head", "did you mean hli.gpCh[0].head?"),
        ("lr_state", "did you mean hli.gpAx[0].lr_state?"),
        ("zzz", "it has gpPform, gpCh"),
    ],
)
def test_a_wrong_name_of_the_hli_tells_the_right_one(
    areas: Areas, name: str, right: str
) -> None:
    """The message was Python's alone."""
    with pytest.raises(AttributeError) as error:
        getattr(areas, name)
    assert f"hli has no member '{name}'; {right}" in str(error.value)


def test_all_channels_are_no_channel(areas: Areas) -> None:
    """``hli.gpCh.bahn_state`` tells how one of them is named."""
    with pytest.raises(AttributeError, match=r"gpCh\[0\]\.bahn_state"):
        areas.gpCh.bahn_state  # type: ignore[attr-defined] # noqa: B018


def test_a_path_is_a_text(areas: Areas) -> None:
    """Anything else is refused as a path that does not exist."""
    with pytest.raises(SymbolError, match="a text is needed"):
        areas.symbol(None)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", ["x", "1.5", None, [1.0], b"1"])
def test_a_wrong_number_names_its_member(areas: Areas, value: object) -> None:
    """Python's message did not tell which one; it read texts, too."""
    request = areas.gpCh[0].contour_lookahead.request
    with pytest.raises(TypeError, match=r"start_position = .*: a number is"):
        request.start_position = value  # type: ignore[assignment]
    with pytest.raises(OverflowError, match="start_position"):
        request.start_position = 10**400
    request.start_position = np.float64(2.5)
    assert request.start_position == 2.5
