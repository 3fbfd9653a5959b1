"""Machine parameters (guide, sections 18.13 and 18.14) as a typed table: unit,
default, range, what each does here.

A parameter whose ``stored`` is empty acts; otherwise it is kept, read and
written by programs, and ``stored`` says why it does not act.  Names of the cell
file are those of the guide; per-axis names carry ``_X`` .. ``_W``, positioner
names ``_P0`` ...
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable
from dataclasses import dataclass

from .homing_modes import is_mode
from .text import AXIS_LETTERS

HUGE = 1e12
POSITIONERS_MAX = 16
ANALOGUE = "the simulated axes follow without a position loop"
PANEL = "operator panel and hand wheel are not simulated"


@dataclass(frozen=True)
class Parameter:
    """``whole``: an integer.

    ``stored``: why it does not act, empty if it does.  ``acts``: what it does.

    ``fits``: of a value in the range, whether there is such a one; ``choices``:
    which there are.
    """

    default: float
    low: float = -HUGE
    high: float = HUGE
    whole: bool = False
    acts: str = ""
    stored: str = ""
    fits: Callable[[float], bool] = lambda _: True
    choices: str = ""


def _not_negative(
    default: float = 0.0, acts: str = "", stored: str = "", high: float = HUGE
) -> Parameter:
    return Parameter(default, 0.0, high, acts=acts, stored=stored)


def _choice(
    default: float, low: float, high: float, acts: str = "", stored: str = ""
) -> Parameter:
    return Parameter(default, low, high, True, acts, stored)


GENERIC: dict[str, Parameter] = {
    "FEEDMAX": _not_negative(acts="upper bound of the feed, 0: none"),
    "FEEDMIN": _not_negative(acts="lower bound of the feed"),
    "FEEDDEF": _not_negative(1000.0, acts="feed until F is programmed"),
    "FEEDRES": Parameter(
        1000.0,
        1.0,
        1000.0,
        True,
        "1: F in mm/min, 1000: F in m/min",
        fits=(1.0, 1000.0).__contains__,
        choices="1 or 1000",
    ),
    "SPEEDMAX": _not_negative(acts="upper bound of S, 0: none"),
    "SPEEDMIN": _not_negative(acts="lower bound of S"),
    "SPEEDDEF": _not_negative(acts="S until it is programmed ($_X0)"),
    "VMAXG0": _not_negative(
        100.0, acts="speed of rapids, % of VMAX; 0: as 100", high=100.0
    ),
    "ACC_G0": _not_negative(
        acts="acceleration of rapids, with TAU, 0: that of the feed"
    ),
    "ACC_LAV": _not_negative(
        acts="acceleration of all axes of the cell, with TAU"
    ),
    "TAU": Parameter(
        5.0, 0.01, 1000.0, acts="sample time of the accelerations, ms"
    ),
    "ACC_QSTOP": _not_negative(
        stored="limits are refused before motion, nothing has to stop at them"
    ),
    "VEL_GO_LINE_RETRACE": _not_negative(
        acts="feed of backward motion, 0: that of the program"
    ),
    "ACC_RAGGIO_MAX": Parameter(
        10.0,
        1.0,
        115.0,
        acts="largest acceleration on arcs, m/s2; over 100 a tenth of what is beyond",
    ),
    "VRIPOSO": _not_negative(
        acts="speed back to the path behind restart and pause, 0: the programmed feed"
    ),
    "SGLP": _not_negative(
        200.0, acts="larger turns in the plane stop, tenths of a degree"
    ),
    "SGLP_RED": _not_negative(
        0.0, acts="% of SGLP from which corners slow down, 0: none", high=100.0
    ),
    "MAX_RED": _not_negative(
        0.0, acts="largest slow-down at corners, %", high=99.999
    ),
    "SGLR": _not_negative(
        10.0,
        acts="largest difference of an arc's radii at start and end, system units",
    ),
    "ACQ_MODE": _choice(0, 0, 255, stored="reserved by the guide"),
    "ACQ_VEL": _not_negative(
        acts="speed of probing (G102), mm/min, 0: the programmed feed"
    ),
    "RESQUOTE": Parameter(
        1000.0,
        10.0,
        100000.0,
        True,
        "system units per mm",
        fits=(10.0, 100.0, 1000.0, 10000.0, 100000.0).__contains__,
        choices="10, 100, 1000, 10000 or 100000",
    ),
    "VISUAREAL": _choice(0, -1, 2, stored="display of the operator interface"),
    "ENABLE_OW_G0": _choice(
        0,
        0,
        2,
        stored="override of rapids is rapid_override_mode of the channel",
    ),
    "CR_LIMIT": _choice(
        2,
        0,
        3,
        stored="limits are always checked before motion, whole arcs included (as 2)",
    ),
    "ARC_REL": _choice(
        0, 0, 1, acts="I and J under G90: 0 absolute, 1 from the start"
    ),
    "NO_SHORT": _choice(0, 0, 2, stored="short segments are removed by G74"),
    "USE_G60": _choice(0, 0, 1, acts="programs begin with G60 in place of G61"),
    "TOL_G60": _not_negative(
        10.0,
        acts="G60: how far the driven path may leave the programmed one at"
        " corners that do not stop, system units; 0: not at all",
    ),
    "TIME_OUT_CMD": _not_negative(
        5000.0, stored="commands to the simulated CN cannot be lost"
    ),
    "TIME_OUT_M": _not_negative(
        5000.0,
        stored="M functions wait for the PLC as their synchronisation says",
    ),
    "TIME_OUT_HOME": _not_negative(
        60000.0, acts="longest homing of an axis, ms: error 1005"
    ),
    "WR_SPD": _choice(0, 0, 1, acts="1: S is copied to $_K9"),
    "RFG": _choice(
        1, 0, 1, stored="the planner always keeps the axes' velocities"
    ),
    "JERK": _not_negative(
        0.0,
        acts="samples (TAU) in which an axis reaches its acceleration (R), "
        "0: at once; without it j_max_mm_s3 of the axes",
        high=100.0,
    ),
}
AXIS: dict[str, Parameter] = {
    "VMAX": _not_negative(
        acts="velocity of the axis in the cell, 0: that of [axes]"
    ),
    "VJOG": _not_negative(stored=PANEL),
    "ACC_JOG": _not_negative(stored=PANEL),
    "RZERO_MODE": Parameter(
        0,
        0,
        65535,
        True,
        "how G71 searches",
        fits=is_mode,
        choices="0 to 9, 32, 64 or 128 + 256 * method",
    ),
    "RZERO_OFFSET": Parameter(
        0.0, acts="way behind the reference, system units"
    ),
    "RZERO_PRESET": Parameter(0.0, acts="position there, system units"),
    "RZERO_VEL": _not_negative(acts="fast search, mm/min, 0: FEEDDEF"),
    "RZERO_VELF": _not_negative(
        acts="slow search, mm/min, 0: a tenth of the fast one"
    ),
    "RZERO_ACC": _not_negative(
        acts="acceleration: how far the fast search overruns the sensor"
    ),
    "LIMITE_N": Parameter(-HUGE, acts="primary lower limit, 0.001 mm"),
    "LIMITE_P": Parameter(HUGE, acts="primary upper limit, 0.001 mm"),
    "2ND_LIMITE_N": Parameter(
        -HUGE, acts="secondary lower limit (G81), 0.001 mm"
    ),
    "2ND_LIMITE_P": Parameter(
        HUGE, acts="secondary upper limit (G81), 0.001 mm"
    ),
    "DSOFV": Parameter(0.0, stored=PANEL),
    "MSOF": Parameter(0.0, stored=ANALOGUE),
    "DSOF": Parameter(0.0, stored=ANALOGUE),
    "GANTRY": _choice(-1, -1, 8, stored="couplings of axes are not simulated"),
    "SGL3D": _not_negative(
        acts="larger changes of direction stop, thousandths, 0: not tested"
    ),
    "SGLAFC": _not_negative(
        acts="largest step of the axis' speed under G66, mm/min, 0: none"
    ),
    "MILD": _not_negative(
        1000.0,
        acts="edge smoothing (G49): 1000 / MILD samples, 0 and 1000: none",
    ),
    "BACKLASH": Parameter(0.0, stored=ANALOGUE),
    "TBCK": Parameter(0.0, stored=ANALOGUE),
    "TSHF": Parameter(0.0, stored="axis shifts are not simulated"),
    "PID_KP": Parameter(0.0, stored=ANALOGUE),
    "PID_KI": Parameter(0.0, stored=ANALOGUE),
    "PID_KV": Parameter(0.0, stored=ANALOGUE),
    "PID_LIMIT": Parameter(0.0, stored=ANALOGUE),
    "PID_DIV": Parameter(0.0, stored=ANALOGUE),
    "PID_SERVO": Parameter(0.0, stored=ANALOGUE),
    "PID_TIME_SERVO": Parameter(0.0, stored=ANALOGUE),
    "PID_DIR": _choice(0, 0, 1, stored=ANALOGUE),
    "PID_OFFS_ANA": Parameter(0.0, stored=ANALOGUE),
}
POSITIONER: dict[str, Parameter] = {
    "VMAX": _not_negative(
        acts="largest feed of the positioner, mm/min, 0: none"
    ),
    "LIMITE_N": Parameter(
        -HUGE, acts="lower limit of the positioner, 0.001 mm"
    ),
    "LIMITE_P": Parameter(HUGE, acts="upper limit of the positioner, 0.001 mm"),
}
# act where the cell is loaded, not where a program writes them
PROGRAM_START = "a program takes it over when it begins"
AT_START = {
    "JERK": "the axes take it over when the cell starts",
    "FEEDDEF": f"{PROGRAM_START}; homing without RZERO_VEL reads it at once",
    "SPEEDDEF": PROGRAM_START,
    "USE_G60": PROGRAM_START,
}
_AXIS_NAME = re.compile(rf"(.+)_([{AXIS_LETTERS}])")
_POSITIONER_NAME = re.compile(r"(.+)_P([0-9]+)")


def parameter(name: str) -> Parameter | None:
    """The parameter of this full name, None if there is none."""
    if name in GENERIC:
        return GENERIC[name]
    found = _AXIS_NAME.fullmatch(name)
    if found and found[1] in AXIS:
        return AXIS[found[1]]
    found = _POSITIONER_NAME.fullmatch(name)
    if found and int(found[2]) < POSITIONERS_MAX:
        return POSITIONER.get(found[1])
    return None


def nearest(name: str) -> str:
    """The known name that looks most like this one."""
    found = _AXIS_NAME.fullmatch(name)
    known = (
        [f"{key}_{found[2]}" for key in AXIS]
        if found
        else [*GENERIC, *(f"{key}_X" for key in AXIS)]
    )
    return difflib.get_close_matches(name, known, n=1, cutoff=0.0)[0]


def wrong_value(name: str, known: Parameter, value: float) -> str:
    """What is wrong with a value, empty if nothing is."""
    if not math.isfinite(value):
        return f"{name} = {value:g} is no finite number"
    if known.whole and value != int(value):
        return f"{name} is a whole number, not {value:g}"
    if not known.low <= value <= known.high:
        return f"{name} = {value:g} is not in {known.low:g}..{known.high:g}"
    if not known.fits(value):
        return f"{name} = {value:g} is none of {known.choices}"
    return ""


def acceleration(increments: float, tau_ms: float) -> float:
    """mm/s2 of an acceleration in system units of 0.001 mm per sample squared
    (a = ACC / TAU^2, m/s2).
    """
    return increments / (tau_ms * tau_ms) * 1000.0


class Parameters:
    """Values by name: those of the cell file, changed by WRITE_PARMAC while the
    program runs.
    """

    def __init__(self, given: dict[str, float]) -> None:
        self._values = dict(given)
        self.written: set[str] = set()  # by the program

    def __getitem__(self, name: str) -> float:
        known = parameter(name)
        assert known is not None, name
        return self._values.get(name, known.default)

    def given(self, name: str) -> bool:
        return name in self._values

    def __setitem__(self, name: str, value: float) -> None:
        self._values[name] = value
        self.written.add(name)

    @property
    def speed_unit(self) -> float:
        """mm/min of the speeds that RESQUOTE affects."""
        return 1000.0 / self["RESQUOTE"]

    def speed(self, name: str) -> float:
        """A speed that RESQUOTE affects, in mm/min: with 0.0001 mm the value is
        in 0.1 mm/min.
        """
        return self[name] * self.speed_unit

    def length(self, name: str) -> float:
        """A length in system units, in mm."""
        return self[name] / self["RESQUOTE"]
