"""Pictures: the path coloured by speed, what the PLC saw of the contour to
come, what it did with it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..engine.causes import TITLES, shares
from ..errors import CncError
from ..units import FloatArray

CAUSE_COLORS = {
    "feed": "tab:green",
    "override": "tab:olive",
    "velocity": "tab:cyan",
    "acceleration": "tab:blue",
    "jerk": "tab:purple",
    "exact_corner": "tab:red",
    "exact_stop": "tab:orange",
    "dwell": "tab:gray",
    "wait": "black",
}
MAX_POINTS = 20_000  # samples drawn at the most


EXTRA = "pictures need the extra: pip install 'hli-cosim[pictures]'"


def can_draw() -> bool:
    """Whether matplotlib is installed."""
    try:
        import matplotlib  # noqa: F401, PLC0415
    except ImportError:
        return False
    return True


def need_matplotlib() -> None:
    """CncError if pictures cannot be drawn."""
    if not can_draw():
        raise CncError(902001, EXTRA)


def _figure(width: float, height: float) -> Any:
    need_matplotlib()
    import matplotlib  # noqa: PLC0415

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    return plt.figure(figsize=(width, height), constrained_layout=True)


def _thin(n: int) -> npt.NDArray[np.int64]:
    places = np.linspace(0, n - 1, min(n, MAX_POINTS))
    return np.unique(places.astype(np.int64))


def _draw_path(
    axes: Any, figure: Any, pos: FloatArray, speed: FloatArray
) -> None:
    from matplotlib.collections import LineCollection  # noqa: PLC0415

    keep = _thin(len(pos))
    points = pos[keep][:, None, :2]
    ends = [points[:-1], points[1:]]
    segments: Any = np.concatenate(ends, axis=1)
    lines = LineCollection(segments, cmap="viridis", linewidths=1.6)
    lines.set_array(speed[keep][1:])
    axes.add_collection(lines)
    axes.autoscale()
    axes.set_aspect("equal", adjustable="datalim")
    figure.colorbar(lines, ax=axes, label="path speed, mm/s", shrink=0.8)


def _plane(columns: dict[str, Any]) -> tuple[FloatArray, tuple[str, str]]:
    """The two axes to draw, (n, 2), and their names; a machine with one axis is
    drawn over time.
    """
    pos = np.asarray(columns["pos"])
    names = [str(axis) for axis in columns["axes"]]
    if pos.shape[1] == 1:
        over_time = np.column_stack([columns["t"], pos[:, 0]])
        return over_time, ("t, s", names[0])
    return pos[:, :2], (f"{names[0]}, mm", f"{names[1]}, mm")


def demo_picture(
    target: Path, columns: dict[str, Any], plc: dict[str, Any]
) -> None:
    """``columns``: a recording; ``plc``: report of the demo PLC (``columns``,
    ``rows``).
    """
    table = {
        name: np.array([row[i] for row in plc["rows"]])
        for i, name in enumerate(plc["columns"])
    }
    figure = _figure(12, 7)
    grid = figure.add_gridspec(3, 2, width_ratios=[1.25, 1.0])
    path = figure.add_subplot(grid[:, 0])
    plane, labels = _plane(columns)
    _draw_path(path, figure, plane, np.asarray(columns["v"]))
    _mark_window(path, columns, plane, table)
    path.set(title="Path coloured by speed", xlabel=labels[0], ylabel=labels[1])
    _draw_times(figure, grid, columns, table)
    figure.savefig(target, dpi=110)


def _mark_window(
    axes: Any,
    columns: dict[str, Any],
    plane: FloatArray,
    table: dict[str, FloatArray],
) -> None:
    """Where the tool was at one scan, and the contour ahead that the PLC knew
    at that moment.
    """
    counts = table["elements"]
    if not len(counts) or not counts.any():
        return
    known = np.where(counts > 0, table["override"], np.inf)
    length = table["window_end"] - table["dist_prog_start"]
    # of the scans with the lowest override the one that looked furthest
    k = int(np.argmax(np.where(known == known.min(), length, -np.inf)))
    s_tenth_um = np.asarray(columns["s"]) * 10_000.0
    seen = (s_tenth_um >= table["dist_prog_start"][k]) & (
        s_tenth_um <= table["window_end"][k]
    )
    here = int(np.searchsorted(s_tenth_um, table["dist_prog_start"][k]))
    # a band below the path: the path's colour stays what the speed is
    axes.plot(
        *plane[seen].T,
        color="black",
        alpha=0.3,
        linewidth=11,
        solid_capstyle="round",
        zorder=0,
        label=f"contour the PLC looked at, {table['override'][k]:.0f} % set",
    )
    axes.plot(
        *plane[min(here, len(plane) - 1)],
        linestyle="none",
        marker="o",
        markerfacecolor="white",
        markeredgecolor="black",
        markeredgewidth=2,
        markersize=9,
        zorder=5,
        label=f"tool at that scan, t = {table['cell_time_s'][k]:.2f} s",
    )
    axes.legend(loc="upper right")


def _draw_times(
    figure: Any,
    grid: Any,
    columns: dict[str, Any],
    table: dict[str, FloatArray],
) -> None:
    places = [grid[i, 1] for i in range(3)]
    speed, override, ahead = (figure.add_subplot(place) for place in places)
    keep = _thin(len(columns["t"]))
    t = table["cell_time_s"]
    speed.plot(
        np.asarray(columns["t"])[keep],
        np.asarray(columns["v"])[keep],
        linewidth=0.9,
    )
    speed.set(title="Path speed, mm/s")
    override.plot(t, table["override"], color="tab:orange", linewidth=0.9)
    override.set(title="Override set by the PLC from the coming contour, %")
    ahead.fill_between(
        t,
        table["dist_prog_start"] / 1e4,
        table["window_end"] / 1e4,
        alpha=0.5,
        label="window looked at",
    )
    ahead.plot(
        t,
        table["max_dist_prog_start"] / 1e4,
        color="tab:green",
        linewidth=0.9,
        label="max_dist_prog_start",
    )
    ahead.plot(
        t,
        table["dist_prog_start"] / 1e4,
        color="black",
        linewidth=0.9,
        label="dist_prog_start",
    )
    ahead.set(title="Distance from program start, mm", xlabel="cell time, s")
    ahead.legend(loc="upper left", fontsize=8)


def _largest_difference(pos: FloatArray, order: int, dt: float) -> FloatArray:
    """(n,) largest derivative of this order among the axes at the cycle; the
    axes stand ahead of the first sample.
    """
    padded = np.vstack([pos[:1]] * order + [pos])
    steps = np.abs(np.diff(padded, n=order, axis=0))
    return np.asarray(steps.max(axis=1) / dt**order)


def _draw_causes(axes: Any, seconds: dict[str, float]) -> None:
    """One bar: the shares of the time by what limited the speed."""
    begin = 0.0
    for name, share in shares(seconds):
        axes.barh(
            0,
            100.0 * share,
            left=begin,
            color=CAUSE_COLORS[name],
            label=f"{TITLES[name]} {100.0 * share:.0f} %",
        )
        begin += 100.0 * share
    axes.set(title="Where the time goes, %", xlim=(0.0, 100.0), yticks=[])
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.5), ncols=5)


def plan_picture(
    target: Path,
    columns: dict[str, Any],
    seconds: dict[str, float] | None = None,
) -> None:
    """Path, speed, and the largest acceleration and jerk of an axis of a
    planned program; ``seconds``: its time by cause, as a bar.
    """
    figure = _figure(11, 9 if seconds else 8)
    grid = figure.add_gridspec(
        4, 2, width_ratios=[1.2, 1.0], height_ratios=[1.0, 1.0, 1.0, 0.12]
    )
    path = figure.add_subplot(grid[:3, 0])
    if seconds:
        _draw_causes(figure.add_subplot(grid[3, :]), seconds)
    speed = figure.add_subplot(grid[0, 1])
    plane, labels = _plane(columns)
    _draw_path(path, figure, plane, np.asarray(columns["v"]))
    path.set(title="Path coloured by speed", xlabel=labels[0], ylabel=labels[1])
    t, pos = np.asarray(columns["t"]), np.asarray(columns["pos"])
    keep = _thin(len(t))
    dt = float(t[1] - t[0]) if len(t) > 1 else 1.0
    path_speed = np.asarray(columns["v"])
    speed.plot(t[keep], path_speed[keep], linewidth=0.9)
    speed.set(title="Path speed, mm/s")
    curves = (
        (2, "Largest axis acceleration, mm/s²", "tab:red"),
        (3, "Largest axis jerk, mm/s³", "tab:purple"),
    )
    for row, (order, title, color) in enumerate(curves, 1):
        axes = figure.add_subplot(grid[row, 1], sharex=speed)
        axes.plot(
            t[keep],
            _largest_difference(pos, order, dt)[keep],
            color=color,
            linewidth=0.7,
        )
        axes.set(title=title)
    axes.set(xlabel="t, s")
    figure.savefig(target, dpi=110)
