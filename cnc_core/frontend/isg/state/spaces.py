"""Coordinates around the offsets: rotation, coordinate systems, transformation.

A programmed value passes, in this order: mirroring, contour rotation, #PSET,
G92 and zero offset as selected inside, each #CS in force from the inside out,
#ACS, tool length, kinematic transformation. Each #CS stands where the offsets
at its selection had put the workpiece.

The stages do the geometry. The state is kept here, and a ``COORDINATES`` row is
made whenever it has changed. The axes do not move by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_core.blocks import COORDINATES, LINEAR, RAPID, motion_planes
from cnc_core.blocks.coordinates import Coordinates, Frame
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.machine import ProgramMachine, TipMachine
from cnc_core.units import FloatArray

from .coordinate_systems import (
    STORED_MAX,
    TOO_MANY,
    Active,
    Order,
    Systems,
    turn,
)
from .offsets import Offsets, Selected

NAME_UNKNOWN = 21601
WRONG_KINEMATICS = 292005
RESERVED = ("MCS", "IMCS", "ACS")


@dataclass(frozen=True)
class Rotation:
    """Contour rotation in a plane: degrees, centre in programmed coordinates, mm."""

    plane: int
    degrees: float
    centre: tuple[float, float]


class Spaces:
    """State of one channel; ``rows`` gives the row that is due."""

    def __init__(
        self, machine: ProgramMachine, modal: Modal, offsets: Offsets
    ) -> None:
        self._machine, self._modal, self._offsets = machine, modal, offsets
        self.cs, self.acs = Systems("CS"), Systems("ACS")
        self.named: list[tuple[str, Frame]] = []
        self.selected: Active | None = None
        self.selected_name = ""
        self.order = Order()
        self.rotation: Rotation | None = None
        self.kin_id = machine.kin_id
        self.active_kin: int | None = None
        self.ptp = False
        self.tlc_mm: float | None = (
            None  # #TLC: length corrected along the tool
        )
        self.mcs = False
        self._said = Coordinates()
        self.due = (
            False  # something has changed that the stages may have to know
        )
        # a change of the plane changes the coordinates: the scanner must not
        # pass over it
        self.watches_plane = False
        offsets.changed = self.touch

    def touch(self) -> None:
        """The coordinates may have changed."""
        self.due = True

    # what is in force

    def wanted(self) -> Coordinates:
        """The coordinates of the present state.

        The offsets learn whether the tool length belongs to them.
        """
        if self.mcs:
            self._offsets.length_elsewhere = False
            return Coordinates()
        frame = Frame()
        for active in self.acs.stack:
            frame = frame @ active.frame
        for active in [
            *([self.selected] if self.selected else []),
            *self.cs.stack,
        ]:
            frame = frame @ Frame(origin=active.shift) @ active.frame
        frame = frame @ self._rotation_frame()
        special = self.active_kin is not None or not frame.identity
        if self.tlc_mm is not None:
            self._offsets.length_elsewhere = not frame.identity
            frame = (
                self._lifted(frame, self._offsets.length_in_force)
                if not frame.identity
                else frame
            )
            return Coordinates(
                frame, self.kin_id, self.tlc_mm, length_only=True
            )
        self._offsets.length_elsewhere = special
        length = self._offsets.length_in_force if special else 0.0
        if self.active_kin is not None:
            return Coordinates(frame, self.active_kin, length, self.ptp)
        return Coordinates(self._lifted(frame, length) if special else frame)

    @property
    def transformed(self) -> bool:
        """A coordinate system or a transformation acts."""
        frames = self.cs.stack or self.acs.stack or self.selected
        kinematic = self.active_kin is not None or self.tlc_mm is not None
        return bool(frames) or self.rotation is not None or kinematic

    @property
    def turned(self) -> FloatArray:
        """(3, 3) from programmed directions to those of the main axes."""
        return self._said.frame.rotation

    def _lifted(self, frame: Frame, length: float) -> Frame:
        """The tool length along the third axis of the plane, around the frame."""
        if not length:
            return frame
        axis = np.zeros(3)
        axis[motion_planes(self._modal.plane)[2]] = length
        return Frame(origin=axis) @ frame

    def _rotation_frame(self) -> Frame:
        """The contour turns about its centre; offsets keep their directions."""
        if self.rotation is None:
            return Frame()
        first, second, third = motion_planes(self.rotation.plane)
        centre = np.zeros(3)
        centre[[first, second]] = self.rotation.centre
        centre += self._main_values(self._offsets.selected_total())
        turned = turn(third, self.rotation.degrees)
        return Frame(turned, centre - turned @ centre)

    def _main_values(self, values: FloatArray) -> FloatArray:
        """(3,) of X, Y, Z; 0 where the machine lacks one."""
        return np.array(
            [values[axis] if axis >= 0 else 0.0 for axis in self._machine.main]
        )

    # rows

    def _watch(self) -> None:
        length = (
            self._offsets.length_elsewhere
            and self.active_kin is None
            and self._offsets.tool_length_mm != 0.0
        )
        self.watches_plane = length or self.rotation is not None

    def rows(self, n: int) -> list[Row]:
        """The row for the stages, if the coordinates have changed.

        The modal position goes into the new coordinates.
        """
        if not self.due:
            return []
        wanted = self.wanted()
        self._offsets.place_length()
        self.due = False
        self._watch()
        if _same(wanted, self._said):
            return []
        position = self.position_in(wanted, self.axes())
        self._said = wanted
        self._modal.set_position(position)
        self._offsets.take_effect(self._machine.main)
        return [self._row(wanted, position, n)]

    def _row(
        self, coordinates: Coordinates, position: FloatArray, n: int
    ) -> Row:
        row = self._modal.row(COORDINATES, n)
        coordinates.fill(row, position)
        return row

    def axes(self) -> FloatArray:
        """(axes,) where the axes of the machine stand behind the last motion."""
        return self.axes_at(self._modal.position)

    def axes_at(self, programmed: FloatArray) -> FloatArray:
        """(axes,) axis positions of a position in the coordinates in force
        (offsets added).
        """
        said, out = self._said, programmed.copy()
        self._store_main(out, said.frame.outer(self._main_values(programmed)))
        if said.kinematics is not None:
            out = self._machine_of(said).driven(out, said.length)[0]
        return out

    def position_in(
        self, coordinates: Coordinates, axes: FloatArray
    ) -> FloatArray:
        """(axes,) the axis position ``axes`` in other coordinates."""
        out = axes.copy()
        if coordinates.kinematics is not None:
            out = self._machine_of(coordinates).programmed(
                out, coordinates.length
            )[0]
        self._store_main(out, coordinates.frame.inner(self._main_values(out)))
        return out

    def _machine_of(self, coordinates: Coordinates) -> TipMachine:
        assert coordinates.kinematics is not None
        machine = self._machine.kinematics[coordinates.kinematics]
        return (
            machine.length_correction() if coordinates.length_only else machine
        )

    def _store_main(self, out: FloatArray, values: FloatArray) -> None:
        for place, axis in enumerate(self._machine.main):
            if axis >= 0:
                out[axis] = values[place]

    # coordinate systems

    def needs_axes(self, frame: Frame, offset: int) -> None:
        """A turned frame needs all axes that it mixes."""
        for place, axis in enumerate(self._machine.main):
            fixed = (
                frame.rotation[place, place] == 1.0
                and frame.origin[place] == 0.0
            )
            if axis < 0 and not fixed:
                raise fail(900016, f"{ERRORS[900016]}: {'XYZ'[place]}", offset)

    def switch_on(self, systems: Systems, number: int, offset: int) -> None:
        """One more coordinate system, in the one in force."""
        self.needs_axes(systems.stored[number], offset)
        systems.stack.append(
            self._taken(systems.stored[number], number, systems is self.cs)
        )
        self.touch()

    def _taken(
        self, frame: Frame, number: int | None, take_offsets: bool
    ) -> Active:
        """The workpiece lies where the offsets in force put it; inside they
        begin at 0.
        """
        if not take_offsets:
            return Active(frame, number, Selected.none(), np.zeros(3))
        shift = self._main_values(self._offsets.selected_total())
        return Active(
            frame, number, self._offsets.put_away(self._machine.main), shift
        )

    def switch_off(self, systems: Systems, *, every: bool = False) -> None:
        """End the last one, or all. Selections made inside them end too."""
        while systems.stack:
            active = systems.stack.pop()
            self._offsets.bring_back(active.offsets)
            systems.forget(active.number)
            self.touch()
            if not every:
                break

    # named ones: #CS ADD

    def find_named(self, name: str, offset: int) -> int:
        """Place in the named stack."""
        for place, (known, _) in enumerate(self.named):
            if known == name:
                return place
        raise fail(NAME_UNKNOWN, f"{ERRORS[NAME_UNKNOWN]}: {name}", offset)

    def add_named(self, name: str, frame: Frame, offset: int) -> None:
        if name in RESERVED or len(name) > 8 or not name:
            raise fail(
                900004,
                f"#CS ADD: {name!r} is no free name of at most 8 characters",
                offset,
            )
        if any(known == name for known, _ in self.named):
            raise fail(900005, f"#CS ADD: {name} exists already", offset)
        if len(self.named) >= STORED_MAX:
            raise fail(
                TOO_MANY, f"#CS ADD: {ERRORS[TOO_MANY]} ({STORED_MAX})", offset
            )
        self.needs_axes(frame, offset)
        self.named.append((name, frame))

    def set_named(self, name: str, frame: Frame, offset: int) -> None:
        place = self.find_named(name, offset)
        self.needs_axes(frame, offset)
        self.named[place] = (name, frame)
        self._refresh_named(self.selected_name, offset)

    def select_named(self, name: str, offset: int) -> None:
        """The chain up to ``name``; MCS: none of them."""
        if name == "MCS":
            self._drop_selected()
            return
        self.find_named(name, offset)
        self._refresh_named(name, offset)

    def delete_named(self, *, every: bool) -> None:
        """End the topmost one, or all.

        If it was in force, the new topmost one is.
        """
        if not self.named:
            return
        del self.named[0 if every else -1 :]
        if self.selected and all(
            known != self.selected_name for known, _ in self.named
        ):
            top = self.named[-1][0] if self.named else ""
            self._refresh_named(top, 0) if top else self._drop_selected()

    def _refresh_named(self, name: str, offset: int) -> None:
        if not name:
            return
        frame = Frame()
        for _, inner in self.named[: self.find_named(name, offset) + 1]:
            frame = frame @ inner
        self.selected_name = name
        if self.selected is None:
            self.selected = self._taken(frame, None, True)
        else:
            self.selected.frame = frame
        self.touch()

    def _drop_selected(self) -> None:
        if self.selected is not None:
            self._offsets.bring_back(self.selected.offsets)
            self.selected, self.selected_name = None, ""
            self.touch()

    # rotation, machine coordinates, transformation

    def set_rotation(self, rotation: Rotation | None) -> None:
        self.rotation = rotation
        self.touch()

    def set_machine_coordinates(
        self, on: bool, *, ex_tool: bool = False
    ) -> None:
        """All transformations and offsets off, or as they were."""
        if on == self.mcs:
            return
        self.mcs = on
        if on:
            self._offsets.enter_machine(ex_tool=ex_tool)
        else:
            self._offsets.leave_machine()
        self.touch()

    def set_trafo(self, number: int | None, offset: int) -> None:
        """A kinematic transformation by number, None: off."""
        if number == 0 and number not in self._machine.kinematics:
            number = None  # the manual's number of no kinematic
        if number is not None and self.active_kin not in (None, number):
            raise fail(20687, ERRORS[20687], offset)
        if number is not None and number not in self._machine.kinematics:
            text = f"kinematic {number} is not defined in the cell ([kinematics.{number}])"
            raise fail(WRONG_KINEMATICS, text, offset)
        self.active_kin = number
        self.touch()

    def set_tlc(self, length_mm: float | None, offset: int) -> None:
        """A length corrected along the tool; None: none."""
        if length_mm is not None and (
            self.kin_id is None or self.kin_id not in self._machine.kinematics
        ):
            raise fail(
                WRONG_KINEMATICS,
                "#TLC ON: the cell has no such kinematic ([kinematics.N])",
                offset,
            )
        self.tlc_mm = length_mm
        self.touch()

    def set_ptp(self, on: bool) -> None:
        self.ptp = on
        self.touch()

    def select_kinematic(self, number: int | None, offset: int) -> None:
        """#KIN ID; None: that of the start."""
        number = self._machine.kin_id if number is None else number
        if number != self.kin_id and (
            self.active_kin is not None or self.tlc_mm is not None
        ):
            raise fail(20687, ERRORS[20687], offset)
        self.kin_id = number

    def tool_kinematic(self, number: int | None, offset: int) -> None:
        """That of a tool (P-TOOL-00011), None: any."""
        if number is None:
            return
        if self.active_kin not in (None, number):
            raise fail(20990, ERRORS[20990], offset)
        self.kin_id = number

    def orient_tool(self, n: int, offset: int) -> list[Row]:
        """The tool into the Z axis of the coordinates in force: rotary axes
        alone move, at rapid.
        """
        said, number = (
            self._said,
            self.kin_id
            if self._said.kinematics is None
            else self._said.kinematics,
        )
        if number is None or number not in self._machine.kinematics:
            raise fail(
                WRONG_KINEMATICS,
                f"#TOOL ORI CS: {ERRORS[WRONG_KINEMATICS]} in the cell",
                offset,
            )
        kinematics, axes = self._machine.kinematics[number], self.axes()
        target = kinematics.orient(said.frame.rotation[:, 2], axes)
        way = float(np.linalg.norm(target - axes))
        if way < 1e-9:
            return []
        move = self._modal.row(LINEAR, n, flags=RAPID)
        move["end"][0, : len(target)], move["length"], move["length_min"] = (
            target,
            way,
            way,
        )
        position = self.position_in(said, target)
        self._modal.set_position(position)
        return [
            self._row(Coordinates(), axes, n),
            move,
            self._row(said, position, n),
        ]


def _same(a: Coordinates, b: Coordinates) -> bool:
    return (
        a.kinematics == b.kinematics
        and a.ptp == b.ptp
        and a.length_only == b.length_only
        and a.length == b.length
        and np.array_equal(a.frame.rotation, b.frame.rotation)
        and np.array_equal(a.frame.origin, b.frame.origin)
    )
