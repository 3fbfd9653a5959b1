"""Pictures of recordings: a matplotlib figure, or a page that needs no network.

Both draw the same panels from the same series: speed, acceleration and jerk with
their limits, look-ahead, override, symbols of the PLC, functions as marks.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import CncError
from .reading import Recording

POINTS = 4000  # of a curve; the extremes of what lies between are kept
# colours that the colour-blind tell apart (Okabe and Ito)
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
PANELS = (
    ("Speed", "mm/s", ("v", "feed")),
    ("Acceleration along the path", "mm/s2", ("acceleration",)),
    ("Jerk along the path", "mm/s3", ("jerk",)),
    ("Override", "%", ("override",)),
)
LIMITS = {"acceleration": "a_max", "jerk": "j_max", "v": "v_max"}


@dataclass
class Curve:
    """One curve of a panel over time (n,) s and path (n,) mm."""

    name: str
    t: npt.NDArray[np.float64]
    s: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]


@dataclass
class Panel:
    """One panel: curves with one unit, and lines of limits."""

    title: str
    unit: str
    curves: list[Curve] = field(default_factory=list)
    limits: dict[str, float] = field(default_factory=dict)


@dataclass
class Mark:
    """A technology function or an event at a time, s."""

    t: float
    s: float
    text: str


@dataclass
class Scene:
    """Everything that is drawn of one or more recordings."""

    titles: list[str]
    panels: list[Panel]
    marks: list[Mark]
    path: list[dict[str, Any]]
    lines: list[str]


def scene_of(recordings: Sequence[Recording]) -> Scene:
    """The panels of several runs over each other.

    CncError: one of them holds no cycles.
    """
    recordings = [one for each in recordings for one in _channels_of(each)]
    for recording in recordings:
        if "cycles" not in recording.tables:
            raise CncError(
                901002, f"{recording.path}: it holds no cycles to draw"
            )
    panels = {title: Panel(title, unit) for title, unit, _ in PANELS}
    panels["Look-ahead"] = Panel("Look-ahead", "mm")
    symbols = Panel("PLC symbols", "")
    marks: list[Mark] = []
    path: list[dict[str, Any]] = []
    seen: set[Path] = set()
    for recording in recordings:
        label = "" if len(recordings) == 1 else f" {_label(recording)}"
        _add_cycles(panels, recording, label)
        if recording.path not in seen:  # all channels have the PLC's
            _add_symbols(symbols, recording, label)
        seen.add(recording.path)
        marks += _marks(recording)
        path.append(_path(recording))
    shown = [*panels.values(), symbols]
    program = recordings[0].meta.get("program", {}).get("text", "")
    return Scene(
        [_title(recording) for recording in recordings],
        [panel for panel in shown if panel.curves],
        marks,
        path,
        program.splitlines()[:20_000],
    )


def _channels_of(recording: Recording) -> list[Recording]:
    """The recording, or each of its channels."""
    names = recording.channels
    return [recording.channel(name) for name in names] or [recording]


def _label(recording: Recording) -> str:
    return " ".join(
        filter(None, (recording.path.stem, recording.meta.get("channel")))
    )


def _title(recording: Recording) -> str:
    return " ".join(
        filter(None, (recording.path.name, recording.meta.get("channel")))
    )


def _column(recording: Recording, name: str) -> npt.NDArray[np.float64] | None:
    cycles = recording.cycles
    if name not in cycles.columns:
        return None
    return np.asarray(cycles[name], np.float64)


def _add_cycles(
    panels: dict[str, Panel], recording: Recording, label: str
) -> None:
    t = recording.cycles["t"]
    s = _column(recording, "s")
    s = np.zeros(len(t)) if s is None else s
    for title, _, names in PANELS:
        for name in names:
            values = _column(recording, name)
            if values is None or not len(values):
                continue
            panel = panels[title]
            keep = thinned(values)
            panel.curves.append(
                Curve(name + label, t[keep], s[keep], values[keep])
            )
            limit = _limit(recording, name)
            if limit:
                panel.limits[f"smallest axis limit{label}"] = limit
    here = _column(recording, "dist_prog_start")
    known = _column(recording, "max_dist_prog_start")
    if here is not None and known is not None and known.any():
        ahead = np.maximum(known - here, 0.0) / 1e4
        keep = thinned(ahead)
        panels["Look-ahead"].curves.append(
            Curve(
                f"contour the PLC can see{label}", t[keep], s[keep], ahead[keep]
            )
        )


def _limit(recording: Recording, name: str) -> float:
    """The smallest limit of a linear axis; 0: none."""
    key = LIMITS.get(name, "")
    axes = recording.meta.get("axes", {}).values()
    values = [axis.get(key, 0.0) for axis in axes if axis["kind"] == "linear"]
    return min((value for value in values if value), default=0.0)


def _add_symbols(panel: Panel, recording: Recording, label: str) -> None:
    if "plc" not in recording.tables:
        return
    table = recording.plc
    names = [n for n in table.columns if n not in ("cycle", "t", "scan")]
    if not names or not len(table):
        return
    t = table["t"]
    s = _path_at(recording, t)
    for name in names:
        values = table[name]
        keep = thinned(values)
        panel.curves.append(Curve(name + label, t[keep], s[keep], values[keep]))


def _path_at(
    recording: Recording, times: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """The path, mm, that was driven at these times; 0 where it is not recorded."""
    place = _column(recording, "s")
    if place is None or not len(place):
        return np.zeros(len(times))
    return np.interp(times, recording.cycles["t"], place)


def _marks(recording: Recording) -> list[Mark]:
    if "functions" not in recording.tables:
        return []
    table = recording.functions
    if not {"t", "kind", "code"} <= {*table.columns}:
        return []
    times = table["t"]
    s = _path_at(recording, times)
    kinds, codes = table["kind"], table["code"]
    return [
        Mark(float(times[i]), float(s[i]), f"{kinds[i]}{codes[i]}")
        for i in range(min(len(times), 500))
    ]


def _path(recording: Recording) -> dict[str, Any]:
    """The path in the plane of the first two axes, with speed and line."""
    axes = [
        a
        for a in recording.meta.get("axes", {})
        if _column(recording, a) is not None
    ]
    if len(axes) < 2:
        return {}
    x, y = (_column(recording, axis) for axis in axes[:2])
    v, line = _column(recording, "v"), _column(recording, "line")
    assert x is not None
    assert y is not None
    keep = np.unique(
        np.linspace(0, max(0, len(x) - 1), min(len(x), POINTS)).astype(int)
    )
    keep = keep[: len(x)]

    def part(values: npt.NDArray[np.float64] | None) -> list[float]:
        return [] if values is None else np.round(values[keep], 5).tolist()

    return {
        "axes": axes[:2],
        "x": part(x),
        "y": part(y),
        "v": part(v),
        "line": part(line),
        "t": part(recording.cycles["t"]),
    }


def thinned(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Rows to draw: all, or the smallest and the largest of each stretch."""
    n = len(values)
    if n <= POINTS:
        return np.arange(n)
    edges = np.linspace(0, n, POINTS // 2 + 1).astype(np.int64)
    found = {0, n - 1}
    for first, end in itertools.pairwise(edges):
        part = values[first:end]
        found |= {first + int(part.argmin()), first + int(part.argmax())}
    return np.array(sorted(found), np.int64)


# ------------------------------------------------------------------ pictures
def write_picture(scene: Scene, target: Path) -> None:
    """The panels over time, the path beside them."""
    import matplotlib  # noqa: PLC0415

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    count = max(1, len(scene.panels))
    figure = plt.figure(
        figsize=(13, max(4.0, 1.9 * count)), constrained_layout=True
    )
    grid = figure.add_gridspec(count, 2, width_ratios=[1.0, 1.3])
    _draw_path(figure.add_subplot(grid[:, 0]), scene)
    first = None
    for row, panel in enumerate(scene.panels):
        axes = figure.add_subplot(grid[row, 1], sharex=first)
        first = first or axes
        for k, curve in enumerate(panel.curves):
            axes.plot(
                curve.t,
                curve.y,
                color=COLORS[k % len(COLORS)],
                linewidth=0.8,
                label=curve.name,
            )
        for name, value in panel.limits.items():
            top = max(float(np.abs(c.y).max()) for c in panel.curves)
            if value <= 2.0 * top:
                axes.axhline(value, color="0.4", linestyle="--", label=name)
        for mark in scene.marks:
            axes.axvline(mark.t, color="0.7", linewidth=0.6)
        axes.set_title(panel.title, fontsize=9)
        axes.set_ylabel(panel.unit)
        axes.legend(fontsize=7, loc="upper right")
        if row == count - 1:
            axes.set_xlabel("t, s")
    figure.savefig(target, dpi=110)
    plt.close(figure)


def _draw_path(axes: Any, scene: Scene) -> None:
    for k, path in enumerate(scene.path):
        if path:
            axes.plot(
                path["x"],
                path["y"],
                color=COLORS[k % len(COLORS)],
                label=scene.titles[k],
            )
            axes.set_xlabel(f"{path['axes'][0]}, mm")
            axes.set_ylabel(f"{path['axes'][1]}, mm")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(fontsize=8)
    axes.set_title("Path")


def write_page(scene: Scene, target: Path) -> None:
    """A page with its data and script inside."""
    panels = [
        {
            "title": panel.title,
            "unit": panel.unit,
            "limits": panel.limits,
            "curves": [
                {
                    "name": curve.name,
                    "t": np.round(curve.t, 6).tolist(),
                    "s": np.round(curve.s, 5).tolist(),
                    "y": [float(f"{value:.7g}") for value in curve.y],
                }
                for curve in panel.curves
            ],
        }
        for panel in scene.panels
    ]
    data = {
        "titles": scene.titles,
        "panels": panels,
        "marks": [vars(mark) for mark in scene.marks],
        "path": scene.path,
        "lines": scene.lines,
        "colors": COLORS,
    }
    # a text of the program must not end the script
    text = json.dumps(data).replace("<", "\\u003c").replace("NaN", "null")
    page = files("cnc_core").joinpath("data/recording.html").read_text()
    target.write_text(page.replace("/*DATA*/null", text), encoding="utf-8")


WRITERS = {".png": write_picture, ".html": write_page}


def show(recordings: Sequence[Recording], target: Path) -> None:
    """Write the picture as the kind of file that the name says."""
    if target.suffix not in WRITERS:
        raise CncError(
            902001, f"{target}: the name must end in {', '.join(WRITERS)}"
        )
    WRITERS[target.suffix](scene_of(recordings), target)
