"""From the records of a setup and the state at G61 to the profile's specification."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cnc_core.blocks.profile_columns import (
    CONTROL_POINTS,
    POINTS,
    POLYNOMIALS,
    AxisPlace,
    AxisRole,
    Chain,
    ChainStep,
    Dynamics,
    JerkMode,
    Marks,
    PointType,
    ProfileAxis,
    ProfileSpec,
    Smoothness,
    ToolShape,
)
from cnc_core.errors import CncError
from cnc_core.frontend.machine import OsaiCell, ProgramMachine, Tool
from cnc_core.frontend.osai import codes
from cnc_core.frontend.osai.setup import Record, Records
from cnc_core.units import FloatArray

KINDS = {"PNT": POINTS, "POL": POLYNOMIALS, "BSP": CONTROL_POINTS}
# words of the setup that the profile keeps as they are
POINT_TYPES: dict[str, PointType] = {"CCP": "CCP", "CLP": "CLP", "AXI": "AXI"}
ROLES: dict[str, AxisRole] = {
    "ABS": "ABS",
    "ORD": "ORD",
    "VRT": "VRT",
    "TAN": "TAN",
    "TAO": "TAO",
    "OTH": "OTH",
}
PLACES: dict[str, AxisPlace] = {
    "LI1": "LI1",
    "LI2": "LI2",
    "LI3": "LI3",
    "WRK": "WRK",
    "TOL": "TOL",
    "OTH": "OTH",
}
JERKS: dict[str, JerkMode] = {"ENA": "profile", "DIS": "none", "AXI": "axes"}
MODES = {"G62": 62, "G63": 63, "G66": 66, "G67": 67}


@dataclass(frozen=True)
class Active:
    """What holds where the profile begins: position (channel axes,), tool
    offset, mm per programmed unit.
    """

    position: FloatArray
    tool: Tool
    unit_mm: float
    degree: int
    count: int
    file: int
    jerk_scale: float | None = None  # JRS of the program


def unused(records: Records) -> list[CncError]:
    """Values of a setup that change nothing, as warnings."""
    sms = records.get("SMS")
    return [
        sms.fail(909270, f"SMS, {name}: {value} {text}", name)
        for name, value, text in (
            ("C1", "ENA", "is for later releases: it has no effect"),
            ("Progr", "DIS", "asks for a debug output: there is none"),
        )
        if sms.word(name) == value
    ]


def in_mm(records: Records, machine: ProgramMachine) -> Records:
    """A setup that ``check`` has found right, every length in mm."""
    turning = frozenset(
        name
        for name, record in records.axes["AXI"].items()
        if machine.rotary[machine.ids.index(int(record.number("Id")))]
    )
    return records.scaled(machine.settings(OsaiCell).setup_mm, turning)


def check(records: Records, machine: ProgramMachine) -> list[CncError]:
    """What is wrong with a setup as a whole."""
    errors: list[CncError] = []
    for step in (_required, _points, _axes, _names, _chain, _tool_direction):
        try:
            step(records, machine)
        except CncError as error:
            errors.append(error)
            break
    return errors


def _required(records: Records, _: ProgramMachine) -> None:
    for code in codes.REQUIRED:
        if code not in records.general and not records.axes.get(code):
            raise records.missing(f"the setup lacks {code}")


def _points(records: Records, _: ProgramMachine) -> None:
    record = records.general["PNT"]
    kind, param = record.word("Type"), record.word("Param")
    if param not in codes.FEED_ON[kind]:
        raise record.fail(
            909208,
            f"feed on {param} does not go with points of type {kind}",
            "Param",
        )


def _axes(records: Records, machine: ProgramMachine) -> None:
    axes = list(records.axes["AXI"].values())
    if len(axes) > codes.AXES_MAX:
        raise axes[codes.AXES_MAX].fail(
            909210,
            f"{len(axes)} axes, a profile has {codes.AXES_MAX} at most",
            "Name",
        )
    ids: set[int] = set()
    for axis in axes:
        _axis(axis, machine, ids)
    for name, wanted in (
        ("Type", ("ABS", "ORD", "VRT")),
        ("CinType", ("LI1", "LI2", "LI3", "WRK", "TOL")),
    ):
        for word in wanted:
            found = [axis for axis in axes if axis.word(name) == word]
            if len(found) > 1:
                raise found[1].fail(
                    909209,
                    f"{word} twice: axes {found[0].word('Name')}, {found[1].word('Name')}",
                    name,
                )
            if not found and word not in ("WRK", "TOL"):
                raise axes[-1].fail(
                    909209,
                    f"no axis is {word}: a profile has three linear axes",
                    name,
                )
    following = [axis for axis in axes if axis.word("Type") in ("TAN", "TAO")]
    if len(following) > 1:
        raise following[1].fail(909209, "two tangential axes", "Type")
    if following and records.general["PNT"].word("Format") != "PNT":
        raise following[0].fail(
            909254,
            "a tangential axis follows points only, not polynomials or B-splines",
            "Type",
        )


def _axis(axis: Record, machine: ProgramMachine, ids: set[int]) -> None:
    number = int(axis.number("Id"))
    name = axis.word("Name")
    if name in "NGFKPEL" or name in "ijkmnopqdtw":
        raise axis.fail(
            909209,
            f"{name} cannot be the name of an axis: the letter has another meaning",
            "Name",
        )
    if number not in machine.ids:
        known = ", ".join(map(str, machine.ids))
        raise axis.fail(
            909209,
            f"axis {name}: the process has no axis with ID {number} (it has {known})",
            "Id",
        )
    if number in ids:
        raise axis.fail(
            909209,
            f"axis {name}: ID {number} belongs to another axis of the setup",
            "Id",
        )
    ids.add(number)
    linear = axis.word("Type") in ("ABS", "ORD", "VRT")
    place = axis.word("CinType")
    if linear != (place in ("LI1", "LI2", "LI3")):
        raise axis.fail(
            909209,
            f"axis {name}: type {axis.word('Type')} does not go with {place}",
            "CinType",
        )
    rotary = machine.rotary[machine.ids.index(number)]
    if linear and rotary:
        raise axis.fail(
            909209, f"axis {name} is a rotary axis of the machine", "Type"
        )
    if place in ("WRK", "TOL") and not rotary:
        raise axis.fail(
            909209, f"axis {name} is no rotary axis of the machine", "CinType"
        )


def _names(records: Records, _: ProgramMachine) -> None:
    for code in ("AXP", "DIN", "CIN"):
        for name, record in records.axes[code].items():
            if name not in records.axes["AXI"] and not (
                code == "CIN" and name in "tw"
            ):
                raise record.fail(
                    909209,
                    f"{code} of axis {name}, which no AXI declares",
                    "Name",
                )
    for record in records.axes["AXP"].values():
        pitch = record.maybe("Pitch")
        axis = records.axes["AXI"][record.word("Name")]
        if (
            pitch
            and axis.word("CinType") in ("WRK", "TOL")
            and abs(pitch / 360.0 - round(pitch / 360.0)) > 1e-9
        ):
            text = f"AXP: Pitch {pitch:g}: a rotary axis of the chain comes round every 360"
            raise record.fail(909205, text, "Pitch")
        low, high = record.maybe("Lim-"), record.maybe("Lim+")
        if low is not None and high is not None and low >= high:
            raise record.fail(
                909205, f"AXP: Lim- {low:g} is not below Lim+ {high:g}", "Lim-"
            )


def _rotaries(records: Records) -> list[Record]:
    return [
        axis
        for axis in records.axes["AXI"].values()
        if axis.word("CinType") in ("WRK", "TOL")
    ]


def _chain(records: Records, _: ProgramMachine) -> None:
    rotaries, mac = _rotaries(records), records.general.get("MAC")
    if not rotaries:
        _no_chain(records, mac)
        return
    if mac is None:
        raise records.missing("the setup lacks MAC: it declares a rotary axis")
    if len(rotaries) < 2:
        name = rotaries[0].word("Name")
        raise rotaries[0].fail(
            909211,
            f"only one rotary axis, {name}: a chain has WRK and TOL",
            "CinType",
        )
    chain = [
        axis.word("Name")
        for axis in records.axes["AXI"].values()
        if axis.word("CinType") != "OTH"
    ]
    for name in (*chain, "t", "w"):
        if name not in records.axes["CIN"]:
            raise records.missing(f"the setup lacks CIN of {name}", 909211)


def _no_chain(records: Records, mac: Record | None) -> None:
    """Nothing of a chain may stand without an axis that turns in it."""
    if mac is not None:
        raise mac.fail(
            909211, "MAC: no axis is WRK or TOL, there is no chain to describe"
        )
    for name, record in records.axes["CIN"].items():
        raise record.fail(909207, f"CIN of {name}: the setup lacks MAC")


def _tool_direction(records: Records, _: ProgramMachine) -> None:
    record = records.get("TOD")
    if not any(record.number(name) for name in ("Xcomp", "Ycomp", "Zcomp")):
        raise record.fail(909250, "TOD: a direction of length zero", "Xcomp")
    tool = records.get("TOL")
    radius = tool.maybe("Radius")
    if radius is not None and tool.number("EdgeRad") > radius + 1e-9:
        raise tool.fail(
            909205,
            f"TOL: edge radius {tool.number('EdgeRad'):g} exceeds the radius {radius:g}",
            "EdgeRad",
        )


def build(
    records: Records, machine: ProgramMachine, active: Active
) -> ProfileSpec:
    """The specification; ``check`` has found no error."""
    records = in_mm(records, machine)
    pnt, thr = records.general["PNT"], records.general["THR"]
    axes = tuple(
        _profile_axis(records, record, machine, active)
        for record in records.axes["AXI"].values()
    )
    kind = KINDS[pnt.word("Format")]
    point = pnt.word("Type")
    five = any(axis.kinematic for axis in axes)
    return ProfileSpec(
        kind=kind,
        axes=axes,
        point=POINT_TYPES[point],
        feed_on=POINT_TYPES[pnt.word("Param")],
        degree=active.degree
        if kind != POINTS
        else {"CUB": 3, "QUI": 5}[pnt.word("Poly")],
        start=active.position,
        count=active.count,
        file=active.file,
        versors=_versors(records, kind, point, five),
        tolerance=thr.number("Tol"),
        versor_tolerance=thr.number("TolV"),
        null_move=thr.number("NullMov"),
        chord=thr.number("Chord"),
        tool=_tool(records, active, machine.settings(OsaiCell).centre),
        feed_by_length=machine.settings(OsaiCell).feed_by_length,
        marks=_marks(records),
        smoothness=_smoothness(records.get("JRK"), active.jerk_scale),
        chain=_kinematics(records),
    )


def _versors(
    records: Records, kind: str, point: str, five: bool
) -> tuple[str, ...]:
    """Versor groups that the profile's blocks have to program."""
    ver, programmed = records.general["VER"], kind != POINTS
    found = []
    if five and point != "AXI" and (programmed or ver.word("Ijk") == "PRG"):
        found.append("ijk")
    for letters, name in (("mno", "Mno"), ("pqd", "Pqd")):
        if point == "CCP" and (programmed or ver.word(name) == "PRG"):
            found.append(letters)
    return tuple(found)


def _profile_axis(
    records: Records, record: Record, machine: ProgramMachine, active: Active
) -> ProfileAxis:
    name = record.word("Name")
    channel = machine.ids.index(int(record.number("Id")))
    linear = record.word("Type") in ("ABS", "ORD", "VRT")
    factor = 1.0 if machine.rotary[channel] else active.unit_mm
    factor *= 0.5 if record.word("Diam") == "ENA" else 1.0
    scale = records.general["THR"].number("Scale")
    factor *= scale if linear and scale else 1.0
    position = records.axes["AXP"].get(name)
    return ProfileAxis(
        name=name,
        channel=channel,
        role=ROLES[record.word("Type")],
        place=PLACES[record.word("CinType")],
        rotary=machine.rotary[channel],
        factor=factor,
        null_move=position.number("NullMov") if position else 0.0,
        pitch=position.maybe("Pitch") if position else None,
        low=position.maybe("Lim-") if position else None,
        high=position.maybe("Lim+") if position else None,
        cutting=_dynamics(
            records.axes["DIN"].get(name), "Vmax", "Amax", "Jmax"
        ),
        rapid=_dynamics(records.axes["DIN"].get(name), "Vrap", "Arap", "Jrap"),
    )


def _dynamics(
    record: Record | None, velocity: str, acceleration: str, jerk: str
) -> Dynamics:
    if record is None:
        return Dynamics()
    speed = record.maybe(velocity)
    return Dynamics(
        None if speed is None else speed / 60.0,
        record.maybe(acceleration),
        record.maybe(jerk),
    )


def _tool(records: Records, active: Active, centre: bool) -> ToolShape:
    tol, tod = records.get("TOL"), records.get("TOD")
    length, radius = tol.maybe("Len"), tol.maybe("Radius")
    radius = active.tool.radius_mm if radius is None else radius
    if (
        tol.number("EdgeRad") > radius + 1e-9
        and records.general["PNT"].word("Type") == "CCP"
    ):
        raise tol.fail(
            909205,
            f"TOL: edge radius {tol.number('EdgeRad'):g} exceeds the active radius {radius:g}",
            "EdgeRad",
        )
    direction = [tod.number(name) for name in ("Xcomp", "Ycomp", "Zcomp")]
    norm = math.hypot(*direction)
    x, y, z = (value / norm for value in direction)
    return ToolShape(
        length=active.tool.length_mm if length is None else length,
        radius=radius,
        edge_radius=min(tol.number("EdgeRad"), radius),
        contact_deg=tol.number("Angle"),
        origin_length=tol.number("OriginLen"),
        direction=(x, y, z),
        centre=centre,
    )


def _marks(records: Records) -> Marks:
    edg, crv = records.get("EDG"), records.get("CRV")
    return Marks(
        edge_deg=edg.number("Angle"),
        versor_deg=edg.number("VAngle"),
        edge_code=MODES[edg.word("Mode")],
        edge_share=edg.number("Acc"),
        long_mm=crv.number("Len"),
        ratio=crv.number("Ratio"),
        ratio_code=MODES[crv.word("Mode")],
    )


def _smoothness(jrk: Record, active: float | None) -> Smoothness:
    own = jrk.maybe("Jrs")
    return Smoothness(
        jerk=JERKS[jrk.word("Mode")],
        scale=active if own is None else own,
        entities=int(jrk.number("Entities")),
        window_s=jrk.number("Tstab") / 1000.0,
        merge_s=jrk.number("Tintgr") / 1000.0,
        constant_s=jrk.number("Ttop") / 1000.0,
    )


def _kinematics(records: Records) -> Chain | None:
    if not _rotaries(records):
        return None
    mac, steps = records.general["MAC"], []
    for name, record in records.axes["CIN"].items():
        x, y, z, a, b, c = (
            record.number(n)
            for n in ("OffX", "OffY", "OffZ", "RotX", "RotY", "RotZ")
        )
        steps.append(ChainStep(name, (x, y, z), (a, b, c)))
    return Chain(mac.word("Type"), mac.word("Bed"), tuple(steps))
