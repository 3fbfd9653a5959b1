"""Where the generator's parameter sets really act, with and without look-ahead.

Run it: ``python examples/spark_erosion/erosion_process.py spark_erosion.png``
"""

import sys
from pathlib import Path

import numpy as np

from cnc_core import Cell

HERE = Path(__file__).parent
CHANGES_AFTER_S = 0.120  # the generator
# spark gap of the two sets: what is wrong in the wrong place
GAP_FINE_MM, GAP_ROUGH_MM = 0.02, 0.09
VARIANTS = ("without_lookahead", "with_lookahead")
R2, ARC = np.sqrt(2.0), np.pi / 2
D1 = 12.0
D2 = D1 + 3 * R2 + 9.0
D3 = D2 + 2 * ARC + 1.0 + 12.0
# details, mm of path
WANTED = (
    (D1, D1 + 3 * R2),
    (D2, D2 + 2 * ARC + 1.0),
    (D3, D3 + 2 * 0.8 * R2),
)


def run(variant, record):
    """One run: the CNC's samples and the set that was asked for."""
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(
            HERE / "part.nc",
            HERE / f"{variant}.py",
            record=record,
            watch=["Generator.fine"],
        )
    assert result.end == "completed", result.errors
    watched = result.plc["watch"]
    return (
        dict(np.load(record)),
        np.array(watched["t"]),
        np.array(watched["Generator.fine"]) > 0,
    )


def gap(samples, t, fine):
    """The gap at every sample: the set that was asked for CHANGES_AFTER_S ago."""
    index = np.searchsorted(t, samples["t"] - CHANGES_AFTER_S, "right") - 1
    asked_fine = (index >= 0) & fine[np.maximum(index, 0)]
    return np.where(asked_fine, GAP_FINE_MM, GAP_ROUGH_MM)


def wanted_gap(s):
    """The gap the details need."""
    details = [(s >= begin) & (s < end) for begin, end in WANTED]
    inside = np.any(details, axis=0)
    return np.where(inside, GAP_FINE_MM, GAP_ROUGH_MM)


def compare(folder):
    """Both variants: {variant: (wrong mm of path, switching errors mm, gap, samples)}."""
    found = {}
    for variant in VARIANTS:
        samples, t, fine = run(variant, Path(folder) / f"{variant}.npz")
        real = gap(samples, t, fine)
        s = samples["s"]
        differs = real != wanted_gap(s)
        wrong = float(np.sum(np.diff(s)[differs[1:]]))
        edges = s[np.flatnonzero(np.diff(real))]
        errors = (
            edges - np.ravel(WANTED)
            if len(edges) == 2 * len(WANTED)
            else np.full(6, np.nan)
        )
        found[variant] = (wrong, errors, real, samples)
    return found


def picture(found, target):
    """The gap over the path, wanted and real."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(
        2, 1, figsize=(9, 4.4), sharex=True, constrained_layout=True
    )
    for ax, name, color in zip(
        axes, VARIANTS, ("tab:red", "tab:green"), strict=True
    ):
        wrong, _, real, samples = found[name]
        s = samples["s"]
        ax.fill_between(
            s, 0, wanted_gap(s) * 1000, step="mid", color="0.88", label="wanted"
        )
        ax.plot(s, real * 1000, color=color, linewidth=1.0, label="real")
        ax.set(
            title=f"{name.replace('_', ' ')}: {wrong:.2f} mm of wall with the wrong gap",
            ylabel="gap, um",
        )
        ax.legend(loc="lower left", fontsize=7)
    axes[1].set_xlabel("place on the path, mm")
    figure.savefig(target, dpi=90)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        found = compare(folder)
    for name, (wrong, errors, _, _) in found.items():
        places = " ".join(f"{e:+.2f}" for e in errors)
        wall = f"{wrong:.2f} mm of wall with the wrong gap"
        print(f"{name:18} {wall}, sets change off by {places} mm")
    picture(found, sys.argv[1] if len(sys.argv) > 1 else "spark_erosion.png")
