"""Parameters of the look-ahead: start-up beside channel, and what is told of
values that do not act as written.
"""

from __future__ import annotations

import pytest

from cnc_core.config import parse_config
from cnc_core.config.channel import KNOWN_FUNCTIONS
from cnc_core.errors import ConfigError

STARTUP = (
    '[startup]\ninterpolator_function = "FCT_LOOK_AHEAD_LOW | '
    'FCT_CONTOUR_LAH"\ncontour_lookahead_log_max = 77\n'
)
ACTING = {
    "FCT_IPO_DEFAULT",
    "FCT_LOOK_AHEAD_LOW",
    "FCT_LOOK_AHEAD_STANDARD",
    "FCT_LOOK_AHEAD_HIGH",
    "FCT_LOOK_AHEAD_CUSTOM",
    "FCT_CALC_STATE_AT_T",
    "FCT_CALC_TIME",
    "FCT_CALC_POS_V_0",
    "FCT_CONTOUR_LAH",
    "FCT_EXTENSION_EQUIDIST",
}


def test_start_up_keys_are_read() -> None:
    """P-STUP-00070 and 00076 act where the channel says nothing."""
    channel = parse_config(STARTUP).channel
    assert (channel.window, channel.contour_lah) == (30, True)
    assert channel.contour_lookahead_log_max == 77


@pytest.mark.parametrize(
    ("own", "window", "entries"),
    [
        ('interpolator_function = "FCT_LOOK_AHEAD_HIGH"', 190, 77),
        ('fct_enable = "FCT_LOOK_AHEAD_HIGH"', 190, 77),
        ("contour_lookahead_log_max = 5", 30, 5),
    ],
)
def test_the_channel_wins_over_start_up(
    own: str, window: int, entries: int
) -> None:
    """Each key for itself; both names of P-CHAN-00650 count."""
    channel = parse_config(f"{STARTUP}[channel]\n{own}\n").channel
    assert channel.window == window
    assert channel.contour_lookahead_log_max == entries


@pytest.mark.parametrize(
    ("text", "line", "match"),
    [
        ("contour_lookahead_log_max = -1", 2, "startup.contour_look"),
        (
            "interpolator_functoin = 1",
            2,
            "did you mean 'interpolator_function'",
        ),
    ],
)
def test_a_wrong_start_up_key_has_its_place(
    text: str, line: int, match: str
) -> None:
    """The table's own line is told, not one of [channel]."""
    with pytest.raises(ConfigError, match=match) as told:
        parse_config(f"[startup]\n{text}\n")
    assert told.value.place.line == line


@pytest.mark.parametrize("name", sorted(KNOWN_FUNCTIONS - ACTING))
def test_identifiers_without_effect_warn(name: str) -> None:
    """Every accepted identifier that changes nothing says so, with the reason."""
    text = f'[channel]\ninterpolator_function = "FCT_IPO_DEFAULT | {name}"\n'
    (warning,) = parse_config(text).warnings()
    assert f"{name} has no effect: " in warning


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ('interpolator_function = "FCT_LOOK_AHEAD_HIGH | FCT_CONTOUR_LAH"', 1),
        (
            'interpolator_function = "FCT_LOOK_AHEAD_HIGH | FCT_CONTOUR_LAH"\n'
            "contour_lookahead_log_max = 190",
            0,
        ),
        ('interpolator_function = "FCT_LOOK_AHEAD_HIGH"', 0),
        ("", 0),
    ],
)
def test_a_log_smaller_than_the_window_is_told(keys: str, told: int) -> None:
    """190 blocks do not fit into 128 entries, the default of P-CHAN-00658."""
    warnings = parse_config(f"[channel]\n{keys}\n").warnings()
    assert len(warnings) == told
    assert all("128 log entries hold less than the 190" in w for w in warnings)


def test_a_nested_key_is_looked_for_in_its_own_table() -> None:
    """Under hscs no key of the channel is proposed."""
    with pytest.raises(ConfigError, match="did you mean 'tolerance'"):
        parse_config("[axes.X]\n[channel.hscs.finish]\ntolerance_mm = 0.01\n")
