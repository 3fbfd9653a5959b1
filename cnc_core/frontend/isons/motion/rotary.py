"""Rotary axes (G36): which way round an absolute position is reached."""

from __future__ import annotations

LINEAR, SHORTEST, POSITIVE, NEGATIVE = 0, 1, 2, 3
TURN = 360.0


def target_of(mode: int, now: float, value: float) -> float:
    """Coordinate to drive to, degrees: ``value`` itself, or the same angle by
    the mode's way.
    """
    if mode == LINEAR:
        return value
    ahead = (value - now) % TURN
    if mode == POSITIVE:
        return now + ahead
    if mode == NEGATIVE:
        return now + (ahead - TURN if ahead else 0.0)
    return now + (ahead - TURN if ahead > TURN / 2 else ahead)
