"""M, H, S and T functions that stand in the technology units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from hli import layout
from hli.areas import Areas
from plc_client.blocks.program_flow import KINDS

from ..observing.sight import Sight

PAYLOADS: dict[str, Any] = {
    "M": layout.HLI_M_H_PROZESS,
    "H": layout.HLI_M_H_PROZESS,
    "S": layout.HLI_S_PROZESS,
    "T": layout.HLI_T_PROZESS,
}


def in_units(
    areas: Areas, channel: int, axes: Iterable[int]
) -> list[dict[str, Any]]:
    """The functions that units of a channel and of these axis areas hold:
    offered, or fetched before.
    """
    found = _of_area(f"gpCh[{channel}]", areas.gpCh[channel]._c)
    for i in axes:
        area = areas.gpAx[i]
        found += _of_area(f"gpAx[{i}]", area._c) if area else ()
    return found


def axis_areas(
    areas: Areas, sights: Sequence[Sight], channel: int, home: range
) -> list[int]:
    """Areas of the axes that a channel has now, and of what no channel has
    (spindles, axes that were let go) but is at ``home`` in this one.
    """
    numbers = [areas.gpAx[i].head._c.log_ax_n_r for i in range(areas.gNrAx)]
    mine = sights[channel].axis_numbers
    anyone = set[int]().union(*(sight.axis_numbers for sight in sights))
    return [
        i
        for i, number in enumerate(numbers)
        if number in mine or (i in home and number not in anyone)
    ]


def _of_area(name: str, area: Any) -> list[dict[str, Any]]:
    return [
        {"unit": f"{name} {array} {k}", **_decoded(unit)}
        for array in ("std", "late")
        for k, unit in enumerate(getattr(area, f"techno_unit_{array}_sync"))
        if unit.fkt_ctrl_r
    ]


def _decoded(unit: Any) -> dict[str, Any]:
    kind = KINDS.get(unit.fkt_ctrl_r, "?")
    structure = PAYLOADS.get(kind, layout.HLI_M_H_PROZESS)
    payload = structure.from_buffer_copy(bytes(unit.attribut_r.data))
    line = n = 0
    if kind == "T":
        number = payload.id.basic
    else:
        line, n = payload.zeilen_nr, payload.satz_nr
        # 1e-3 degrees/s
        number = round(payload.rev / 6000.0) if kind == "S" else payload.nr
    waiting = bool(unit.please_rw)
    return {
        "kind": kind,
        "number": int(number),
        "line": int(line),
        "n": int(n),
        "synch": int(payload.synch_mode),
        "offered": waiting,
        "acknowledged": bool(unit.done_w) and not waiting,
    }
