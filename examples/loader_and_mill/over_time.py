"""Mill and loader over time: where they are, and who holds the part.

Run it: ``python examples/loader_and_mill/over_time.py loader_and_mill.png``
"""

import sys
from pathlib import Path

import numpy as np

from cnc_core import Cell

HERE = Path(__file__).parent
MILL, LOADER = "gpCh[0]^.bahn_state", "gpCh[1]^.bahn_state"
WATCHED = {
    "mill_x": f"{MILL}.coord_r[0].act_position_r",
    "mill_z": f"{MILL}.coord_r[2].act_position_r",
    "loader_x": f"{LOADER}.coord_r[0].act_position_r",
    "loader_z": f"{LOADER}.coord_r[1].act_position_r",
    "vice": "HandOver.vice_shut",
    "gripper": "HandOver.gripper_shut",
}


def run():
    """One run: the result, and arrays over the scans, mm and 0/1."""
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(
            [HERE / "mill.nc"],
            HERE / "hand_over.py",
            watch=list(WATCHED.values()),
        ).check()
    columns = {"t": np.array(result.columns["t"])}
    for name, symbol in WATCHED.items():
        scale = 1e-4 if symbol.endswith("position_r") else 1.0
        columns[name] = np.array(result.columns[symbol], float) * scale
    return result, columns


def picture(columns, target):
    """Both machines above, vice and gripper below."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (above, below) = pyplot.subplots(
        2, 1, sharex=True, figsize=(9, 5), height_ratios=(3, 1)
    )
    for name in ("mill_x", "mill_z", "loader_x", "loader_z"):
        above.plot(columns["t"], columns[name], label=name.replace("_", " "))
    above.set_ylabel("position, mm")
    above.legend(loc="upper right", ncols=4)
    for i, name in enumerate(("vice", "gripper")):
        shut = columns[name] > 0
        below.fill_between(
            columns["t"], i, i + 0.8 * shut, label=name, step="post"
        )
    below.set_yticks((0.4, 1.4), ("vice", "gripper"))
    below.set_xlabel("cell time, s")
    figure.tight_layout()
    figure.savefig(target, dpi=110)


if __name__ == "__main__":
    told, found = run()
    print(f"{told.plc['result']['parts']} parts in {found['t'][-1]:.2f} s")
    if len(sys.argv) > 1:
        picture(found, sys.argv[1])
