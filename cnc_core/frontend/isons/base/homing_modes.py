"""Numbers of RZERO_MODE."""

from __future__ import annotations

SENSOR_MODE_MAX = 9
BY_INDEX = (8, 9)
NO_SEARCH = 32
ABSOLUTE = 64
DRIVE = 128
METHOD = 256
# DS402: a signed byte, negative numbers belong to the makers of drives
METHOD_MAX = 127


def is_mode(value: float) -> bool:
    """0 to 9, 32, 64, or 128 + 256 * method."""
    number = int(value)
    by_drive = number % METHOD == DRIVE and number // METHOD <= METHOD_MAX
    return (
        0 <= number <= SENSOR_MODE_MAX
        or number in (NO_SEARCH, ABSOLUTE)
        or (number > 0 and by_drive)
    )
