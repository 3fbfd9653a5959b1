"""TwinCAT-style symbol paths name the same memory as the views."""

from collections.abc import Iterator

import pytest

import hli
from hli.areas import Areas
from hli.symbol import SymbolError
from support.fake_cnc import unique_name


@pytest.fixture
def areas() -> Iterator[Areas]:
    """One channel, three axes."""
    with hli.create(unique_name()) as segment:
        yield Areas(segment)


@pytest.mark.parametrize(
    "path",
    [
        "HLI_Global_Variables.gpCh[0]^.bahn_state.dist_prog_start",
        "gpCh[0]^.bahn_state.dist_prog_start",
        "GPCH[ 0 ]^.Bahn_State.DIST_prog_start",
        ".gpCh[0].bahn_state.dist_prog_start",
        "hli_global_variables.gpCh[0]^.bahn_state.dist_prog_start_high",
    ],
)
def test_spellings_of_one_variable(areas: Areas, path: str) -> None:
    """Namespace, caret and case are optional; aliases work; read and write go to the memory."""
    symbol = areas.symbol(path)
    areas.gpCh[0].bahn_state.dist_prog_start = 12.5
    assert symbol.value == 12.5
    symbol.value = 99.0
    assert areas.gpCh[0].bahn_state.dist_prog_start == 99.0


def test_arrays_axes_platform_and_external_variables(areas: Areas) -> None:
    """Indices by number or constant; V.E areas are arrays by themselves."""
    areas.symbol(
        "gpCh[0]^.bahn_state.coord_r[HLI_Global_Constants.HLI_CS_AXIS_MAXIDX].act_position_r"
    ).value = -7
    assert areas.gpCh[0].bahn_state.coord_r[31].act_position_r == -7
    areas.symbol(
        "gpAx[2]^.lr_mc_control.release_feedhold.enable_w"
    ).value = True
    assert areas.gpAx[2].lr_mc_control.release_feedhold.enable_w
    areas.symbol("gpVECh[0]^[6]").value = 4
    assert areas.gpVECh[0][6] == 4
    assert areas.symbol("gpPform^.customer_val_r[3]").value == 0
    assert areas.symbol("gNrCh").value == 1
    assert (
        areas.symbol("GPAX[2]^.head.LOG_ax_n_r").path
        == "HLI_Global_Variables.gpAx[2]^.head.log_ax_n_r"
    )


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("", "a name is needed"),
        ("gpCh[0]^.bahn_stat.x", "did you mean bahn_state"),
        ("gpCh[0]^.bahn_state.dist_prog_start.x", "has no members"),
        ("gpCh[12]^.head", r"runs 0\.\.11"),
        ("gpCh[1]^.head.channel_nr", "NULL"),
        ("gpCh[x]^.head", "neither a number nor a constant"),
        ("gpCh[0]^.bahn_state[1]", "is no array"),
        ("gpCh[0]^.bahn_state.§", "not understood"),
        ("gpFoo.x", "unknown"),
    ],
)
def test_wrong_paths_say_where_they_stop(
    areas: Areas, path: str, text: str
) -> None:
    """SymbolError, a ValueError."""
    with pytest.raises(SymbolError, match=text):
        _ = areas.symbol(path).value
