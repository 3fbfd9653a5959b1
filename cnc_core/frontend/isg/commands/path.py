"""# commands about the path: contouring, smoothing, velocity profile, limits of
the path.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail

from ..state.contouring import (
    ACTIONS,
    DEFAULTS,
    NOT_GIVEN,
    ContourMode,
    Tolerances,
)
from ..state.dynamics import MINUTES, PROFILES
from .base import CommandBase, Items, Run

DEVIATION_MIN_MM = (
    1e-4  # smallest PATH_DEV (120129) and corner distance (120131)
)
COMMON = (
    "RELEVANT_PATH",
    "RELEVANT_TRACK",
    "TRACK_DEV",
    "REMAIN_PART",
    "MAX_ANGLE",
    "CHECK_JERK",
    "CONST_VEL",
)
SOFT_KEYS = (
    "PATH_DIST",
    "TRACK_DIST",
    "SYM_DIST",
    "ACC_MAX",
    "ACC_MIN",
    "RAMP_TIME",
    "DIST_WEIGHT",
    "DIST_WEIGTH",
)
# keys of the modes beside the actions
KEYS: dict[str, tuple[str, ...]] = {
    "DEV": ("PATH_DEV", *COMMON),
    "DIST": ("PRE_DIST", "POST_DIST", *COMMON),
    "DIST_SOFT": SOFT_KEYS,
    "DIST_MASTER": SOFT_KEYS,
    "POS": ("PRE_DIST", "POST_DIST", "CHECK_JERK", "CONST_VEL"),
    "PTP": ("PATH_DEV", "PATH_DIST", "MERGE", "CONST_VEL"),
    "AUTO_DEV": ("PATH_DEV", *COMMON),
    "AUTO_VEL": ("VEL", *COMMON),
}
ALL_KEYS = sorted({key for keys in KEYS.values() for key in keys})
WITHOUT_EFFECT = (
    "CHECK_JERK",
    "TRACK_DIST",
    "RAMP_TIME",
    "DIST_WEIGHT",
    "DIST_WEIGTH",
    "MERGE",
)
HSC_KEYS = (
    *(
        "PATH_DEV",
        "TRACK_DEV",
        "MERGE",
        "AUTO_OFF_PATH",
        "AUTO_OFF_TRACK",
        "AUTO_OFF_G00",
        "AUTO_OFF_G0",
    ),
    *("AUTO_OFF_G60", "MAX_PATH_LENGTH", "MAX_ANGLE", "OPMODE", "CONTERROR"),
)
HSC_STORED = (
    "MERGE",
    "AUTO_OFF_PATH",
    "AUTO_OFF_TRACK",
    "AUTO_OFF_G00",
    "AUTO_OFF_G0",
    "AUTO_OFF_G60",
    "OPMODE",
)
FILTER_KEYS = (
    "ORDER",
    "ORDER_TIME",
    "SHARE",
    "AX_DEV",
    "FCUT",
    "ACC_FACT",
    "QUALITY",
)
# in inch under G70
DISTANCES = ("PRE_DIST", "POST_DIST", "PATH_DIST", "SYM_DIST", "RELEVANT_PATH")
LENGTHS = {"PATH_DEV", *DISTANCES, "CONTERROR", "MAX_PATH_LENGTH", "AX_DEV"}
Values = dict[str, float]


class PathCommands(CommandBase):
    """#CONTOUR MODE, #HSC, #FILTER, #SLOPE, #VECTOR LIMIT."""

    # contouring

    def _contour_mode(self) -> Run:
        """``[ON | OFF] [[mode] key=value ..]``."""
        word = self._stream.accept_name("ON", "OFF")
        switch = word.text.upper() if word else ""
        made: Callable[[], ContourMode] | None = None
        if self._stream.is_op("["):
            if switch == "OFF":
                raise fail(
                    900010,
                    "#CONTOUR MODE OFF takes no keys",
                    self._stream.current.offset,
                )
            made = self._contour_keys()
        elif not switch:
            raise fail(
                900010,
                f"#CONTOUR MODE: expected [, ON or OFF, found {self._stream.describe()}",
                self._start,
            )

        def run() -> Items:
            contouring, n = self._state.channel.contouring, self._modal.n
            rows: Items = []
            if made is not None:
                rows += contouring.set_mode(made(), n, self._start)
            if switch:
                self._state.channel.check_contouring(
                    switch == "ON", self._start
                )
                rows += contouring.switch(switch == "ON", n)
            return rows

        return run

    def _contour_keys(self) -> Callable[[], ContourMode]:
        axes = {
            self._state.offsets.names[a]: a
            for a in self._state.machine.main
            if a >= 0
        }
        known: Mapping[str, bool | None] = dict.fromkeys(
            (*DEFAULTS, *ACTIONS), False
        ) | dict.fromkeys(ALL_KEYS, True)
        keys = self._keys({**known, **dict.fromkeys(axes, True)})
        names = [name for name in DEFAULTS if name in keys]
        actions = [name for name in ACTIONS if name in keys]
        if len(names) > 1 or len(actions) > 1:
            raise fail(
                120207,
                f"#CONTOUR MODE: {' and '.join((names, actions)[len(names) < 2])} together",
                self._start,
            )
        name = names[0] if names else ""
        formulas = {
            key: self._number_of(value, key)
            for key, value in keys.items()
            if value is not None
        }

        def made() -> ContourMode:
            old = self._state.channel.contouring.mode
            mode = DEFAULTS[name] if name else old
            if actions:
                mode = replace(mode, action=ACTIONS[actions[0]])
            values = self._evaluated(formulas)
            self._check_contour_keys(
                mode.name,
                set(values) - set(axes),
                bool(set(values) & set(axes)),
            )
            interim = {
                axes[key]: value for key, value in values.items() if key in axes
            }
            mode = (
                replace(mode, interim=interim) if mode.name == "POS" else mode
            )
            return _with_values(
                mode,
                {k: v for k, v in values.items() if k not in axes},
                self._start,
            )

        return made

    def _check_contour_keys(
        self, name: str, keys: set[str], interim: bool
    ) -> None:
        wrong = sorted(keys - set(KEYS[name])) + (
            ["an interim point"] if interim and name != "POS" else []
        )
        if wrong:
            raise fail(
                120207,
                f"#CONTOUR MODE [{name}] takes no {', '.join(wrong)}",
                self._start,
            )
        for key in sorted(keys & set(WITHOUT_EFFECT)):
            self._state.channel.stored_without_effect(
                f"#CONTOUR MODE [{key}]", self._start
            )

    def _number_of(self, value: Formula, key: str) -> Callable[[], float]:
        offset = self._start

        def number() -> float:
            found = value()
            if isinstance(found, str):
                raise fail(
                    907011, f"{key}: a number is expected, not a text", offset
                )
            return float(found)

        return number

    def _number_keys(
        self, known: Mapping[str, bool | None]
    ) -> dict[str, Callable[[], float] | None]:
        """Keys with numbers; None where a key has no value."""
        found = self._keys(known)
        return {
            key: None if value is None else self._number_of(value, key)
            for key, value in found.items()
        }

    def _evaluated(
        self, formulas: Mapping[str, Callable[[], float] | None]
    ) -> dict[str, float]:
        """Values of the keys that have one: lengths in mm, also under G70."""
        unit = self._modal.unit_mm
        found = {key: f() for key, f in formulas.items() if f is not None}
        return {
            key: value * unit if key in LENGTHS and value != -1.0 else value
            for key, value in found.items()
        }

    # smoothing

    def _hsc(self) -> Run:
        """``ON [BSPLINE PATH_DEV=.. ..]``, ``OFF``, ``[..]``."""
        word = self._stream.accept_name("ON", "OFF")
        switch = word.text.upper() if word else ""
        keys: dict[str, Callable[[], float] | None] | None = None
        if self._stream.is_op("["):
            keys = self._hsc_keys()
        elif not switch:
            raise fail(
                900010,
                f"#HSC: expected ON, OFF or [, found {self._stream.describe()}",
                self._start,
            )

        def run() -> Items:
            channel = self._state.channel
            if keys is not None and switch != "OFF":
                self._set_hsc(keys)
            if not switch:
                return []
            channel.not_compensated("#HSC", self._start)
            if switch == "ON":
                channel.check_hsc(self._start)
            return [*channel.smooth.switch_hsc(switch == "ON", self._modal.n)]

        return run

    def _hsc_keys(self) -> dict[str, Callable[[], float] | None]:
        """BSPLINE and SURFACE stand first."""
        first = self._stream.following
        known: Mapping[str, bool | None] = {
            "BSPLINE": False,
            "SURFACE": False,
        } | dict.fromkeys(HSC_KEYS, True)
        keys = self._number_keys(known)
        kinds = {"BSPLINE", "SURFACE"} & set(keys)
        if len(kinds) > 1 or (kinds and first.text.upper() not in kinds):
            raise fail(
                900010, "#HSC: BSPLINE or SURFACE stands first", first.offset
            )
        return keys

    def _set_hsc(self, keys: dict[str, Callable[[], float] | None]) -> None:
        channel = self._state.channel
        values = self._evaluated(keys)
        old = channel.smooth.hsc_settings
        path = values.get(
            "PATH_DEV", values.get("CONTERROR", old.path if not keys else 0.2)
        )
        track = values.get("TRACK_DEV", 5.0)
        for key, value in (("PATH_DEV", path), ("TRACK_DEV", track)):
            if not 0 <= value <= 1e6:
                raise fail(
                    900012, f"#HSC: {key} {value:g} out of range", self._start
                )
        angle, length = (
            values.get("MAX_ANGLE", 0.0),
            values.get("MAX_PATH_LENGTH", 0.0),
        )
        if not 0 <= angle <= 180 or length < 0:
            raise fail(
                900012,
                "#HSC: MAX_ANGLE is 0..180 degrees, MAX_PATH_LENGTH not negative",
                self._start,
            )
        if channel.smooth.hsc is not None:
            raise fail(
                120433, "#HSC: the settings change while it is on", self._start
            )
        channel.smooth.hsc_settings = Tolerances(
            path or 1.0, track or 10.0, angle, length
        )
        for key in HSC_STORED:
            if values.get(key):
                channel.stored_without_effect(f"#HSC [{key}]", self._start)

    def _filter(self) -> Run:
        """``ON [AX_DEV=.. ..]``, ``OFF``."""
        word = self._stream.accept_name("ON", "OFF")
        if word is None:
            raise fail(
                900010,
                f"#FILTER: expected ON or OFF, found {self._stream.describe()}",
                self._start,
            )
        on = word.text.upper() == "ON"
        known: Mapping[str, bool | None] = dict.fromkeys(FILTER_KEYS, True)
        keys = self._number_keys(known) if self._stream.is_op("[") else {}

        def run() -> Items:
            channel = self._state.channel
            channel.not_compensated("#FILTER", self._start)
            values = self._evaluated(keys)
            deviation = values.get("AX_DEV", 0.0)
            if deviation < 0:
                raise fail(
                    900012,
                    f"#FILTER: AX_DEV {deviation:g} is negative",
                    self._start,
                )
            for key in sorted(set(values) - {"AX_DEV"}):
                channel.stored_without_effect(f"#FILTER [{key}]", self._start)
            return [
                *channel.smooth.switch_filter(
                    deviation if on else None, self._modal.n
                )
            ]

        return run

    # profile

    def _slope(self) -> Run:
        """``[TYPE=STEP | TRAPEZ | SIN2 | HSC NO_OPT=0|1]``, ``DEFAULT``."""
        stream, name = self._stream, "HSC"
        if not stream.accept_name("DEFAULT"):
            name = self._slope_keys() or self._state.channel.dynamics.profile

        def run() -> Items:
            return [
                *self._state.channel.dynamics.set_profile(name, self._modal.n)
            ]

        return run

    def _slope_keys(self) -> str:
        stream, name = self._stream, ""
        opened = self._formulas.open() if stream.is_op("[") else -1
        if opened < 0:
            raise fail(
                900010,
                f"#SLOPE: expected [ or DEFAULT, found {stream.describe()}",
                self._start,
            )
        while not stream.is_op("]"):
            if stream.at_end:
                raise fail(900013, "bracket is not closed", opened)
            if stream.accept(","):
                continue
            key = self._key({"TYPE": True, "NO_OPT": True, "DEFAULT": False})
            if key == "DEFAULT":
                name = "HSC"
            elif key == "NO_OPT":
                self._key_value(key)
                self._state.channel.stored_without_effect(
                    "#SLOPE [NO_OPT]", self._start
                )
            else:
                stream.accept("=")
                name = self._key(dict.fromkeys(PROFILES, False))
        self._formulas.close(opened)
        return name

    def _old_slope(self) -> Run:
        """``#SET SLOPE PROFIL [0..3]``."""
        opened = self._formulas.open()
        number = self._formulas.number("#SET SLOPE PROFIL", self._start)
        self._formulas.close(opened)

        def run() -> Items:
            value = number()
            if value not in (0, 1, 2, 3):
                raise fail(
                    900012,
                    f"#SET SLOPE PROFIL [{value:g}]: 0..3 are known",
                    self._start,
                )
            return [
                *self._state.channel.dynamics.set_profile(
                    list(PROFILES)[int(value)], self._modal.n
                )
            ]

        return run

    # limits of the path

    def _vector_limit(self) -> Run:
        """``ON [VEL=.. ACC=.. ..]``, ``ON ALL``.

        VEL in mm/min, accelerations in mm/min^2, jerks in mm/min^3.
        """
        dynamics = self._state.channel.dynamics
        if self._stream.accept_name("ALL"):
            return lambda: self._limits_changed(dynamics.limit_path_again)
        known: Mapping[str, bool | None] = dict.fromkeys(
            (*MINUTES, "FEED", "RAPID"), None
        )
        keys = self._number_keys(known)

        def run() -> Items:
            limits = {
                key: None if value is None else value()
                for key, value in keys.items()
            }
            for key, value in limits.items():
                if value is not None and not value > 0:
                    raise fail(
                        900012,
                        f"#VECTOR LIMIT: {key} must be positive",
                        self._start,
                    )
            rapid = "RAPID" in limits
            for key in ("FEED", "RAPID"):
                bound = limits.pop(key, None)
                if bound is not None:
                    limits["VEL"] = min(bound, limits.get("VEL") or bound)
            scaled = {
                key: None if v is None else v * self._modal.unit_mm
                for key, v in limits.items()
            }
            return self._limits_changed(
                lambda: dynamics.limit_path(scaled, rapid)
            )

        return run

    def _limits_changed(self, change: Callable[[], None]) -> Items:
        channel = self._state.channel
        change()
        channel.feeds.set_limit(channel.dynamics.path_velocity)
        return [*channel.dynamics.rows(self._modal.n)]

    def _vector_limit_off(self) -> Run:
        """``OFF``, ``OFF ALL``, ``OFF [VEL ..]``."""
        keys: set[str] = set()
        if self._stream.is_op("["):
            keys = set(
                self._keys(dict.fromkeys((*MINUTES, "FEED", "RAPID"), False))
            )
            keys |= {"VEL"} if keys & {"FEED", "RAPID"} else set()
        else:
            self._stream.accept_name("ALL")
        return lambda: self._limits_changed(
            lambda: self._state.channel.dynamics.free_path(keys)
        )

    def _old_vector(self, key: str) -> Run:
        """``#VECTORVEL ON [v]``, ``OFF``; ``#VECTORACC``."""
        word = self._stream.accept_name("ON", "OFF")
        value: Callable[[], float] | None = None
        if word is None:
            raise fail(
                900010,
                f"#VECTOR{key}: expected ON or OFF, found {self._stream.describe()}",
                self._start,
            )
        if word.text.upper() == "OFF":
            return lambda: self._limits_changed(
                lambda: self._state.channel.dynamics.free_path({key})
            )
        if self._stream.is_op("["):
            opened = self._formulas.open()
            value = self._formulas.number(f"#VECTOR{key}", self._start)
            self._formulas.close(opened)

        def run() -> Items:
            given = None if value is None else value() * self._modal.unit_mm
            if given is not None and not given > 0:
                raise fail(
                    900012, f"#VECTOR{key} must be positive", self._start
                )
            return self._limits_changed(
                lambda: self._state.channel.dynamics.limit_path(
                    {key: given}, False
                )
            )

        return run


def _in_range(
    value: float, key: str, low: float, high: float, offset: int
) -> float:
    if not low <= value <= high:
        raise fail(
            900012,
            f"#CONTOUR MODE: {key} {value:g} out of range {low:g}..{high:g}",
            offset,
        )
    return value


def _with_values(mode: ContourMode, values: Values, offset: int) -> ContourMode:
    """The mode with the values of a command."""
    changed: dict[str, Any] = {}
    for key, field, high in (
        ("TRACK_DEV", "track_dev", 1e6),
        ("RELEVANT_PATH", "relevant_path", 1e6),
        ("RELEVANT_TRACK", "relevant_track", 1e6),
        ("MAX_ANGLE", "max_angle", 180.0),
        ("CONST_VEL", "const_vel", 1.0),
    ):
        if key in values:
            changed[field] = _in_range(values[key], key, 0.0, high, offset)
    if "const_vel" in changed:
        changed["const_vel"] = changed["const_vel"] >= 0.5
    for key, field in (
        ("REMAIN_PART", "remain"),
        ("ACC_MIN", "share"),
        ("VEL", "share"),
    ):
        if key in values:
            changed[field] = (
                _in_range(values[key], key, 0.0, 100.0, offset) / 100.0
            )
    if "ACC_MAX" in values:
        share = (
            _in_range(values["ACC_MAX"], "ACC_MAX", 0.0, 100.0, offset) / 100.0
        )
        changed["share"] = min(changed.get("share", mode.share), share)
    if "PATH_DEV" in values:
        if values["PATH_DEV"] < DEVIATION_MIN_MM:
            raise fail(
                120129,
                f"{ERRORS[120129]}: {values['PATH_DEV']:g} mm, {DEVIATION_MIN_MM:g} mm",
                offset,
            )
        changed["path_dev"] = _in_range(
            values["PATH_DEV"], "PATH_DEV", 0.0, 1e6, offset
        )
    changed |= _distances(mode, values, offset)
    return replace(mode, **changed)


def _distances(
    mode: ContourMode, values: Values, offset: int
) -> dict[str, float]:
    """Corner distances; those of the soft modes are equal, and -1 leaves them free."""
    found: dict[str, float] = {}
    for key in ("PATH_DIST", "SYM_DIST"):
        if key in values:
            free = values[key] == -1.0 and mode.name in (
                "DIST_SOFT",
                "DIST_MASTER",
            )
            found["pre"] = found["post"] = NOT_GIVEN if free else values[key]
    for key, field in (("PRE_DIST", "pre"), ("POST_DIST", "post")):
        if key in values:
            found[field] = values[key]
    least = 0.0 if mode.name == "POS" else DEVIATION_MIN_MM
    for value in found.values():
        if value != NOT_GIVEN and not least <= value <= 1e6:
            raise fail(
                120131, f"{ERRORS[120131]}: {value:g} mm, {least:g} mm", offset
            )
        if value == NOT_GIVEN and mode.name not in ("DIST_SOFT", "DIST_MASTER"):
            raise fail(
                120131, f"{ERRORS[120131]}: {value:g} mm, {least:g} mm", offset
            )
    return found
