"""Pictures: the path coloured by speed, and where the time goes."""

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


def new_figure(width: float, height: float) -> Any:
    need_matplotlib()
    import matplotlib  # noqa: PLC0415

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    return plt.figure(figsize=(width, height), constrained_layout=True)


def thinned(n: int) -> npt.NDArray[np.int64]:
    places = np.linspace(0, n - 1, min(n, MAX_POINTS))
    return np.unique(places.astype(np.int64))


def draw_path(
    axes: Any, figure: Any, pos: FloatArray, speed: FloatArray
) -> None:
    from matplotlib.collections import LineCollection  # noqa: PLC0415

    keep = thinned(len(pos))
    points = pos[keep][:, None, :2]
    ends = [points[:-1], points[1:]]
    segments: Any = np.concatenate(ends, axis=1)
    lines = LineCollection(segments, cmap="viridis", linewidths=1.6)
    lines.set_array(speed[keep][1:])
    axes.add_collection(lines)
    axes.autoscale()
    axes.set_aspect("equal", adjustable="datalim")
    figure.colorbar(lines, ax=axes, label="path speed, mm/s", shrink=0.8)


def plane_of(columns: dict[str, Any]) -> tuple[FloatArray, tuple[str, str]]:
    """The two axes to draw, (n, 2), and their names; a machine with one axis is
    drawn over time.
    """
    pos = np.asarray(columns["pos"])
    names = [str(axis) for axis in columns["axes"]]
    if pos.shape[1] == 1:
        over_time = np.column_stack([columns["t"], pos[:, 0]])
        return over_time, ("t, s", names[0])
    return pos[:, :2], (f"{names[0]}, mm", f"{names[1]}, mm")


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
    figure = new_figure(11, 9 if seconds else 8)
    grid = figure.add_gridspec(
        4, 2, width_ratios=[1.2, 1.0], height_ratios=[1.0, 1.0, 1.0, 0.12]
    )
    path = figure.add_subplot(grid[:3, 0])
    if seconds:
        _draw_causes(figure.add_subplot(grid[3, :]), seconds)
    speed = figure.add_subplot(grid[0, 1])
    plane, labels = plane_of(columns)
    draw_path(path, figure, plane, np.asarray(columns["v"]))
    path.set(title="Path coloured by speed", xlabel=labels[0], ylabel=labels[1])
    t, pos = np.asarray(columns["t"]), np.asarray(columns["pos"])
    keep = thinned(len(t))
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
