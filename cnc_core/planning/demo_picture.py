"""The demo's picture: one moment of the PLC on the path, override and speed
under it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..units import FloatArray
from .picture import draw_path, new_figure, plane_of, thinned

_MM = 1e4  # 0.1 um in a millimetre
_CAUSE = "tab:red"


@dataclass
class Moment:
    """A scan in which the PLC lowered the override; places in mm of path."""

    time_s: float
    tool: float
    window_end: float
    before: float
    override: float
    cause: float  # start of the element that decided
    cause_end: float
    radius: float  # mm; 0: a corner

    @property
    def seen(self) -> str:
        """What decided."""
        arc = f"an arc of R {self.radius:g} mm"
        return arc if self.radius else "a corner"

    @property
    def reason(self) -> str:
        """The same beside its place."""
        return re.sub("^an? ", "because of this ", self.seen)


def moment_of(table: dict[str, FloatArray]) -> Moment | None:
    """The scan that tells most: the deepest drop because of an arc, else because
    of a corner; None without any drop.
    """
    override = table["override"]
    drops = np.concatenate([[0.0], override[:-1] - override[1:]])
    for possible in (table["cause_radius"] > 0.0, table["cause_start"] >= 0.0):
        # an arc that is met some way ahead shows more than one at the tool
        ahead = table["cause_start"] - table["dist_prog_start"] > _MM
        found = np.where(possible & ahead, drops, 0.0)
        k = int(np.argmax(found)) if len(found) else 0
        if len(found) and found[k] > 0.0:
            return Moment(
                float(table["cell_time_s"][k]),
                float(table["dist_prog_start"][k]) / _MM,
                float(table["window_end"][k]) / _MM,
                float(override[k - 1]),
                float(override[k]),
                float(table["cause_start"][k]) / _MM,
                float(table["cause_end"][k]) / _MM,
                float(table["cause_radius"][k]) / _MM,
            )
    return None


def demo_picture(
    target: Path, columns: dict[str, Any], plc: dict[str, Any]
) -> str:
    """``columns``: a recording; ``plc``: report of the demo PLC (``columns``,
    ``rows``).  Returns what the picture shows.
    """
    table = {
        name: np.array([row[i] for row in plc["rows"]])
        for i, name in enumerate(plc["columns"])
    }
    figure = new_figure(11, 10)
    grid = figure.add_gridspec(3, 1, height_ratios=[3.2, 1.0, 1.0])
    path = figure.add_subplot(grid[0])
    plane, labels = plane_of(columns)
    draw_path(path, figure, plane, np.asarray(columns["v"]))
    path.set(xlabel=labels[0], ylabel=labels[1])
    moment = moment_of(table)
    title = "A PLC that reads the contour ahead and lowers the override"
    if moment is not None:
        _mark(path, columns, plane, moment)
        title = (
            f"At t = {moment.time_s:.2f} s the PLC sees {moment.seen} ahead"
            f" and sets {moment.override:.0f} %"
        )
    path.set_title(title)
    override, speed = (figure.add_subplot(grid[k]) for k in (1, 2))
    _draw_times(override, speed, columns, table, moment)
    figure.savefig(target, dpi=110)
    return title


def _mark(
    axes: Any, columns: dict[str, Any], plane: FloatArray, moment: Moment
) -> None:
    """Tool, window and what decided, each with its words beside it."""
    s = np.asarray(columns["s"])
    seen = plane[(s >= moment.tool) & (s <= moment.window_end)]
    # a band below the path: the path's colour stays what the speed is
    axes.plot(
        *seen.T,
        color="black",
        alpha=0.25,
        linewidth=13,
        solid_capstyle="round",
        zorder=0,
        label="the contour that the PLC reads ahead of the tool",
    )
    end = moment.cause_end if moment.radius else moment.cause
    arc = plane[(s >= moment.cause) & (s <= end)]
    axes.plot(*arc.T, color=_CAUSE, linewidth=6, alpha=0.7, zorder=1)
    tool = _at(plane, s, moment.tool)
    axes.plot(
        *tool,
        linestyle="none",
        marker="o",
        markerfacecolor="white",
        markeredgecolor="black",
        markeredgewidth=2,
        markersize=10,
        zorder=5,
        label=f"the tool at t = {moment.time_s:.2f} s",
    )
    change = f"{moment.before:.0f} % to {moment.override:.0f} %"
    cause = _at(plane, s, (moment.cause + end) / 2.0)
    said = [
        (tool, f"brakes here:\noverride {change}", "black"),
        (cause, moment.reason, _CAUSE),
    ]
    # the words stand at the right edge: the upper arrow reaches further
    said.sort(key=lambda one: float(one[0][0]))
    for place, (point, text, color) in zip((0.93, 0.79), said, strict=True):
        _say(axes, point, text, color, place)
    axes.legend(loc="upper left", fontsize=9)


def _at(plane: FloatArray, s: FloatArray, place: float) -> FloatArray:
    k = min(int(np.searchsorted(s, place)), len(plane) - 1)
    found: FloatArray = plane[k]
    return found


def _say(
    axes: Any, point: FloatArray, text: str, color: str, height: float
) -> None:
    """Words at the right edge, with an arrow to a point."""
    axes.annotate(
        text,
        xy=tuple(point),
        xytext=(0.99, height),
        textcoords="axes fraction",
        ha="right",
        va="center",
        color=color,
        fontsize=11,
        fontweight="bold",
        arrowprops={"arrowstyle": "->", "color": color, "shrinkB": 8},
        zorder=6,
    )


def _draw_times(
    override: Any,
    speed: Any,
    columns: dict[str, Any],
    table: dict[str, FloatArray],
    moment: Moment | None,
) -> None:
    keep = thinned(len(columns["t"]))
    override.plot(
        table["cell_time_s"],
        table["override"],
        color="tab:orange",
        linewidth=1.2,
        drawstyle="steps-post",
    )
    override.set(title="Override that the PLC sets, %", ylim=(0.0, 110.0))
    speed.plot(
        np.asarray(columns["t"])[keep],
        np.asarray(columns["v"])[keep],
        linewidth=1.0,
    )
    speed.set(title="Path speed, mm/s", xlabel="cell time, s")
    speed.sharex(override)
    for axes in (override, speed):
        axes.grid(alpha=0.3)
        if moment is not None:
            axes.axvline(moment.time_s, color=_CAUSE, linewidth=1.2)
    if moment is not None:
        override.annotate(
            "the moment above",
            xy=(moment.time_s, 8.0),
            xytext=(5.0, 0.0),
            textcoords="offset points",
            color=_CAUSE,
            fontsize=9,
        )
