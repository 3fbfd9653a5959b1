"""Axis exchange: which axis stands at a place of an engine's channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cnc_core._engine import ffi, lib

from . import Engine


@dataclass(frozen=True)
class PlacedAxis:
    """The axis at a place of a channel.

    ``limits``: of velocity, acceleration, jerk.  ``position``: mm.  ``area``:
    index of its axis area, ``number`` its logical number: -1 and 0 where there
    is no axis.  ``type``: as in the HLI.
    """

    limits: tuple[float, float, float]
    position: float
    area: int = -1
    number: int = 0
    type: int = 0
    name: str = ""


def put_axes(engine: Engine, axes: Mapping[int, PlacedAxis]) -> None:
    """What stands at places of the channel from now on.

    The channel stands and has executed everything.  ``Engine.resync`` or
    ``begin_program`` follows.
    """
    running = engine.started
    if running:
        engine.stop()
    for place, axis in axes.items():
        _put(engine, place, axis)
    if running:
        engine.start()


def _put(engine: Engine, place: int, axis: PlacedAxis) -> None:
    made = ffi.new("engine_axis *")
    made.v_max, made.a_max, made.j_max = axis.limits
    made.position, made.area = axis.position, axis.area
    made.number, made.type = axis.number, axis.type
    made.name = axis.name.encode()[:15]
    if lib.engine_set_axis(engine._handle, place, made):
        raise MemoryError("axis exchange")
