"""``FOLDER PICTURE``: machining time and contour error of the study."""

import sys
from pathlib import Path

from cnc_core.sweep import Results


def draw(folder: str, picture: str) -> None:
    """One line a jerk: time and deviation over the tolerance."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    study = Results(folder)
    jerk = study["cell.axes.X.j_max_mm_s3"]
    figure, (above, below) = plt.subplots(2, sharex=True, figsize=(7, 6))
    for value, mark in zip(sorted(set(jerk)), "os^", strict=True):
        rows = jerk == value
        tolerance = study["run.tolerance"][rows]
        label = f"{value / 1000:.0f} m/s³"
        time = study["plan.motion_time_s"][rows]
        error = study["plan.path_deviation_mm"][rows]
        above.plot(tolerance, time, marker=mark, label=label)
        below.plot(tolerance, error, marker=mark, label=label)
    above.set_ylabel("machining time, s")
    below.set_ylabel("largest contour error, mm")
    below.set_xlabel("allowed deviation, mm")
    above.legend(title="jerk limit of X and Y")
    for axes in (above, below):
        axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(Path(picture))


if __name__ == "__main__":
    draw(*sys.argv[1:3])
