"""A CNC without an engine, for unit tests of PLC programs: a script of
elements, the CNC's side of every unit.

>>> from plc_client.mock import MockCnc, line, arc, m                        #
doctest: +SKIP
>>> cnc = MockCnc([line(30), arc(20, 1.57), m(50), line(10)], feed_mm_s=50)  #
doctest: +SKIP
"""

from .cnc import MockCnc
from .script import (
    Step,
    arc,
    cnc_error,
    distance_reset,
    dwell,
    h,
    line,
    log_off,
    log_on,
    log_param,
    m,
    optional_stop,
    polynomial,
    rapid,
    s,
    stop,
    t,
)

__all__ = [
    "MockCnc",
    "Step",
    "arc",
    "cnc_error",
    "distance_reset",
    "dwell",
    "h",
    "line",
    "log_off",
    "log_on",
    "log_param",
    "m",
    "optional_stop",
    "polynomial",
    "rapid",
    "s",
    "stop",
    "t",
]
