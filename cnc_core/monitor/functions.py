"""M, H, S and T functions that stand in the technology units."""

from __future__ import annotations

from typing import Any

from hli import layout
from hli.areas import Areas
from plc_client.blocks.program_flow import KINDS

PAYLOADS: dict[str, Any] = {
    "M": layout.HLI_M_H_PROZESS,
    "H": layout.HLI_M_H_PROZESS,
    "S": layout.HLI_S_PROZESS,
    "T": layout.HLI_T_PROZESS,
}


def in_units(areas: Areas) -> list[dict[str, Any]]:
    """The functions that the units hold: offered, or fetched before."""
    found: list[dict[str, Any]] = []
    for name, pointers in (("gpCh", areas.gpCh), ("gpAx", areas.gpAx)):
        for i, area in enumerate(pointers):
            found += _of_area(f"{name}[{i}]", area._c) if area else ()
    return found


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
