"""Where the beads really lie, with and without look-ahead.

Run it: ``python examples/dispenser/dispenser_process.py dispenser.png``
"""

import sys
from pathlib import Path

import numpy as np

from cnc_core import Cell

HERE = Path(__file__).parent
OPENS_AFTER_S, CLOSES_AFTER_S = 0.035, 0.020  # the valve's dead times
VARIANTS = ("without_lookahead", "with_lookahead")
QUARTER = np.pi / 2 * 10.0
# mm of path
WANTED = (
    (20.0, 60.0),
    (80.0 + QUARTER, 130.0 + 2 * QUARTER),
    (150.0 + 2 * QUARTER, 180.0 + 2 * QUARTER),
)


def run(variant, record):
    """One run: the CNC's samples and the valve's command at every scan."""
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(
            HERE / "part.nc",
            HERE / f"{variant}.py",
            record=record,
            watch=["Valve.open"],
        )
    assert result.end == "completed", result.errors
    watched = result.plc["watch"]
    return (
        dict(np.load(record)),
        np.array(watched["t"]),
        np.array(watched["Valve.open"]) > 0,
    )


def beads(samples, t, command):
    """(begin, end) of every bead in mm of path.

    A bead begins where the tool is when the valve has opened.
    It ends where the tool is when the valve has closed.
    """
    edges = np.flatnonzero(np.diff(command.astype(int), prepend=0))
    times = [
        t[i] + (OPENS_AFTER_S if command[i] else CLOSES_AFTER_S) for i in edges
    ]
    places = np.interp(times, samples["t"], samples["s"])
    pairs = zip(places[::2], places[1::2], strict=True)
    return [(float(begin), float(end)) for begin, end in pairs]


def compare(folder):
    """Both variants: {variant: (beads, samples)}."""
    found = {}
    for variant in VARIANTS:
        samples, t, command = run(variant, Path(folder) / f"{variant}.npz")
        found[variant] = (beads(samples, t, command), samples)
    return found


def errors_mm(found):
    """{variant: ends of all beads, found minus wanted}."""
    return {
        name: (np.array(got) - np.array(WANTED)).ravel()
        for name, (got, _) in found.items()
    }


def picture(found, target):
    """The wanted and the real beads on the path."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(
        1, 2, figsize=(10, 4), sharey=True, constrained_layout=True
    )
    for ax, name in zip(axes, VARIANTS, strict=True):
        got, samples = found[name]
        s, x, y = samples["s"], *samples["pos"][:, :2].T
        ax.plot(x, y, color="0.7", linewidth=0.8)
        for a, b in WANTED:
            inside = (s >= a) & (s <= b)
            ax.plot(
                x[inside],
                y[inside],
                color="0.85",
                linewidth=12,
                solid_capstyle="butt",
            )
        for a, b in got:
            inside = (s >= a) & (s <= b)
            ax.plot(
                x[inside],
                y[inside],
                color="tab:blue",
                linewidth=4,
                solid_capstyle="butt",
            )
        worst = np.abs(errors_mm(found)[name]).max()
        ax.set(
            title=f"{name.replace('_', ' ')}: ends at most {worst:.2f} mm off",
            xlabel="X, mm",
            aspect="equal",
        )
    axes[0].set_ylabel("Y, mm (grey: wanted, blue: glue)")
    figure.savefig(target, dpi=90)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        found = compare(folder)
    for name, errors in errors_mm(found).items():
        told = " ".join(f"{e:+.2f}" for e in errors)
        print(f"{name:18} bead ends off by {told} mm")
    picture(found, sys.argv[1] if len(sys.argv) > 1 else "dispenser.png")
