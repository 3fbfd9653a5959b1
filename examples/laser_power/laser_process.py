"""Energy per length along the cut, with and without look-ahead.

Run it: ``python examples/laser_power/laser_process.py laser_power.png``
"""

import sys
from pathlib import Path

import numpy as np

from cnc_core import Cell

HERE = Path(__file__).parent
DEAD_S, RISE_S = 0.010, 0.015  # the laser source: dead time, then first order
SPOT_MM = 1.0  # heat spreads over this length
WANTED = 20.0  # J/mm
VARIANTS = ("without_lookahead", "with_lookahead")


def run(variant, record):
    """One run: the CNC's samples and the power the PLC asked for."""
    with Cell(HERE / "cell.toml") as cell:
        result = cell.run(
            HERE / "part.nc",
            HERE / f"{variant}.py",
            record=record,
            watch=["LaserPower.power_w"],
        )
    assert result.end == "completed", result.errors
    watched = result.plc["watch"]
    return (
        dict(np.load(record)),
        np.array(watched["t"]),
        np.array(watched["LaserPower.power_w"]),
    )


def laser(t, power, at):
    """Power of the beam at the times `at` for a command given at `t`."""
    out, beam = np.zeros(len(at)), 0.0
    command = np.interp(at - DEAD_S, t, power, left=power[0])
    for i, step in enumerate(np.diff(at, prepend=at[0])):
        beam += (command[i] - beam) * (1.0 - np.exp(-step / RISE_S))
        out[i] = beam
    return out


def energy_per_length(samples, t, power):
    """(place in mm, J/mm): the beam's energy, spread over a spot.

    The first 20 mm and the last 5 mm are left out.
    """
    beam = laser(t, power, samples["t"])
    steps = beam[1:] * np.diff(samples["t"])
    energy = np.concatenate([[0.0], np.cumsum(steps)])
    s, first = np.unique(samples["s"], return_index=True)
    place = np.arange(20.0, s[-1] - 5.0, 0.05)
    ahead, behind = (
        np.interp(end, s, energy[first])
        for end in (place + SPOT_MM / 2, place - SPOT_MM / 2)
    )
    return place, (ahead - behind) / SPOT_MM


def compare(folder):
    """Both variants: {variant: (place, J/mm, samples)}."""
    found = {}
    for variant in VARIANTS:
        samples, t, power = run(variant, Path(folder) / f"{variant}.npz")
        found[variant] = (*energy_per_length(samples, t, power), samples)
    return found


def worst(found):
    """Largest deviation of the energy per length in percent."""
    return {
        name: float(np.abs(e - WANTED).max() / WANTED * 100.0)
        for name, (_, e, _) in found.items()
    }


def picture(found, target):
    """Speed and energy per length over the path."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (speed, energy) = plt.subplots(
        2, 1, figsize=(9, 5), sharex=True, constrained_layout=True
    )
    samples = found["with_lookahead"][2]
    speed.plot(samples["s"], samples["v"], color="black", linewidth=0.9)
    speed.set(
        ylabel="path speed, mm/s", title="Laser: power follows the coming radii"
    )
    for name, color in zip(VARIANTS, ("tab:red", "tab:green"), strict=True):
        label = (
            f"{name.replace('_', ' ')}: at most {worst(found)[name]:.0f} % off"
        )
        place, joules = found[name][:2]
        energy.plot(place, joules, color=color, linewidth=1.0, label=label)
    energy.axhline(WANTED, color="black", linewidth=0.6)
    energy.set(xlabel="place on the path, mm", ylabel="energy per length, J/mm")
    energy.legend()
    figure.savefig(target, dpi=90)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        found = compare(folder)
    for name, percent in worst(found).items():
        print(f"{name:18} energy per length at most {percent:5.1f} % off")
    picture(found, sys.argv[1] if len(sys.argv) > 1 else "laser_power.png")
