"""What the swinging tool does at the corners, with and without look-ahead.

Run it: ``python examples/sharp_tangents/tangents_process.py sharp_tangents.png``
"""

import sys
from pathlib import Path

import numpy as np

from cnc_core import Cell

HERE = Path(__file__).parent
FREQUENCY_HZ, DAMPING = 9.0, 0.06  # the arm between drive and tool
VARIANTS = ("without_lookahead", "with_lookahead")
CORNERS = np.array(
    [
        [120.0, 0.0],
        [120.0, 80.0],
        [60.0, 20.0],
        [20.0, 60.0],
        [120.0, 100.0],
    ]
)


def run(variant, record):
    """One run: the CNC's samples, the tool held still behind the end for a while."""
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(
            HERE / "part.nc",
            HERE / f"{variant}.py",
            record=record,
            watch=["Feed.percent"],
        )
    assert result.end == "completed", result.errors
    return dict(np.load(record)), result.sim_time_s


def tool(t, path):
    """The tool on its arm: a damped spring per axis (exact linear step).

    The commanded position drives the spring.
    """
    w, z = 2.0 * np.pi * FREQUENCY_HZ, DAMPING
    step = float(t[1] - t[0])
    wd = w * np.sqrt(1.0 - z * z)
    decay = np.exp(-z * w * step)
    c, s = np.cos(wd * step) * decay, np.sin(wd * step) * decay
    out = np.empty_like(path)
    x, v = path[0].copy(), np.zeros(path.shape[1])
    for i, target in enumerate(path):
        d = x - target
        a = (v + z * w * d) / wd
        x = target + d * c + a * s
        away, along = d * c + a * s, a * c - d * s
        v = -z * w * away + wd * along
        out[i] = x
    return out


def overshoot(samples):
    """Per corner mm by which the tool leaves the contour, mm/s at which it passes.

    The third result is the tool's path.
    """
    path = samples["pos"][:, :2]
    at = tool(samples["t"], path)
    step = samples["t"][1] - samples["t"][0]
    velocity = np.diff(at, axis=0, prepend=at[:1]) / step
    away, passing = np.zeros(len(CORNERS)), np.zeros(len(CORNERS))
    for i, corner in enumerate(CORNERS):
        k = int(np.argmin(np.linalg.norm(path - corner, axis=1)))
        before = path[k] - path[k - 20]
        near = slice(k, k + 120)
        contour = path[k - 400 : k + 600]
        apart = at[near][:, None] - contour[None]
        nearest = np.linalg.norm(apart, axis=2).min(axis=1)
        away[i] = nearest.max()
        passing[i] = max(velocity[k] @ before / np.linalg.norm(before), 0.0)
    return away, passing, at


def compare(folder):
    """{variant: (overshoot mm, passing speed mm/s, tool path, samples, time s)}."""
    found = {}
    for variant in VARIANTS:
        samples, seconds = run(variant, Path(folder) / f"{variant}.npz")
        found[variant] = (*overshoot(samples), samples, seconds)
    return found


def picture(found, target):
    """Path and tool, near the worst corner and as a whole; speed over the path."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13, 4), constrained_layout=True)
    colors = dict(zip(VARIANTS, ("tab:red", "tab:green"), strict=True))
    path = found["with_lookahead"][3]["pos"]
    for ax in axes[:2]:
        ax.plot(*path[:, :2].T, color="black", linewidth=0.7)
    for name, (away, _, at, samples, seconds) in found.items():
        label = f"{name.replace('_', ' ')}: {away.max():.2f} mm off the contour"
        for ax in axes[:2]:
            ax.plot(*at.T, color=colors[name], linewidth=0.9, label=label)
        axes[2].plot(
            samples["s"],
            samples["v"],
            color=colors[name],
            linewidth=0.9,
            label=f"{seconds:.2f} s",
        )
    axes[0].set(
        title="Tool on its slender arm",
        xlabel="X, mm",
        ylabel="Y, mm",
        aspect="equal",
    )
    axes[0].legend(fontsize=7)
    axes[1].set(
        title="Corner at X120 Y0",
        xlim=(114, 122),
        ylim=(-2, 6),
        xlabel="X, mm",
        aspect="equal",
    )
    axes[2].set(title="Path speed, mm/s", xlabel="place on the path, mm")
    axes[2].legend(fontsize=7)
    figure.savefig(target, dpi=90)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        found = compare(folder)
    for name, (away, speed, _, _, seconds) in found.items():
        corners = f"corners passed with at most {speed.max():4.0f} mm/s"
        off = f"{away.max():.2f} mm off the contour"
        print(f"{name:18} {off}, {corners}, {seconds:.2f} s")
    picture(found, sys.argv[1] if len(sys.argv) > 1 else "sharp_tangents.png")
