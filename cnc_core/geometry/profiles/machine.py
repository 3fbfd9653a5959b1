"""The machine of a profile, and the tool directions that it gives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cnc_core.blocks.profile_columns import ProfileSpec
from cnc_core.kinematics.chain import Step
from cnc_core.kinematics.machine import Kinematics
from cnc_core.kinematics.machine_types import Element, machine_chain
from cnc_core.units import FloatArray


def machine_of(
    spec: ProfileSpec, number: int, limits: tuple[FloatArray, FloatArray]
) -> Kinematics:
    """The machine of a profile with rotary axes; ValueError if its chain does
    not make one.
    """
    assert spec.chain is not None
    given = spec.chain.steps
    steps = {step.name: Step(step.offset, step.rotation) for step in given}
    low, high = (limit.copy() for limit in limits)
    elements: dict[str, Element] = {}
    for axis in spec.axes:
        if axis.place != "OTH":
            elements[axis.place] = Element(axis.channel, steps[axis.name])
        low[axis.channel] = max(
            low[axis.channel], -np.inf if axis.low is None else axis.low
        )
        high[axis.channel] = min(
            high[axis.channel], np.inf if axis.high is None else axis.high
        )
    chain = machine_chain(
        spec.chain.kind, spec.chain.bed, elements, steps["w"], steps["t"]
    )
    x, y, z = (spec.axes[i].channel for i in spec.linear)
    return Kinematics(chain, (x, y, z), low, high, number)


def tool_directions(
    spec: ProfileSpec, kinematics: Kinematics | None
) -> Callable[[FloatArray], FloatArray] | None:
    """Tool directions of points (n, columns): as programmed, or as the rotary
    axes point; None on three axes.
    """
    part = spec.versor_columns("ijk")
    if part is not None:
        return lambda values: values[:, part]
    if kinematics is None:
        return None

    def pointed(values: FloatArray) -> FloatArray:
        q = np.tile(spec.start, (len(values), 1))
        for i, axis in enumerate(spec.axes):
            q[:, axis.channel] = values[:, i]
        return kinematics.directions(q)

    return pointed
