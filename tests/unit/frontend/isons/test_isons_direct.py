"""G71 homing, G100 commands on the path, G102 probing of the IsoNs dialect
against simulated sensors.
"""

import pytest

from cnc_core.blocks import EVENT, EVENT_COMMAND, EXACT_STOP
from cnc_core.config import load_config, parse_config
from cnc_core.errors import CncError, ConfigError
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.isons_programs import run

SENSORS = (
    "[isons.homing.X]\nnegative = -20\npositive = 30\nindex = 8\n"
    "index_offset = 1\nabsolute = 3\n"
)
SENSORS += "limit_negative = -50\nlimit_positive = 60\n"
HOMING = (
    "[isons]\nRZERO_MODE_X = {}\nRZERO_VEL_X = 1000\n"
    "RZERO_VELF_X = 100\nRZERO_OFFSET_X = 5000\n"
    "RZERO_PRESET_X = 1000\n"
)


def homed(folder, mode, more=""):
    return run(
        folder,
        "G71X\n$A=$_Q0\n$B=$_Q100\n",
        HOMING.format(mode) + more + SENSORS,
    )


@pytest.mark.parametrize(
    ("mode", "ends"),
    [
        (0, [-20, -19.9, -20]),
        (1, [30, 29.9, 30]),
        (2, [-20, -19.9, -20, -23]),
        (3, [30, 29.9, 30, 33]),
        (4, [-20, -19.9]),
        (5, [30, 29.9]),
        (6, [-20, -19.9, -15]),
        (7, [30, 29.9, 25]),
        (8, [-7]),
        (9, [1]),
        (32, []),
        (128 + 256 * 35, []),
        (128 + 256 * 5, [-20, -19.9, -15]),
        (128 + 256 * 19, [30, 29.9]),
        (128 + 256 * 34, [1]),
        (128 + 256 * 1, [-50, -49.9, -47]),
        (128 + 256 * 2, [60, 59.9, 57]),
        (128 + 256 * 3, [30, 29.9, 25]),
        (128 + 256 * 4, [30, 29.9, 30, 33]),
        (128 + 256 * 6, [-20, -19.9, -20, -23]),
        (128 + 256 * 17, [-50, -49.9]),
        (128 + 256 * 18, [60, 59.9]),
        (128 + 256 * 20, [30, 29.9, 30]),
        (128 + 256 * 21, [-20, -19.9]),
        (64, []),
    ],
)
def test_every_rzero_mode(tmp_path, mode, ends):
    """To the sensor fast, away and back slowly, to the index; then to
    RZERO_OFFSET, where RZERO_PRESET counts.
    """
    out = homed(tmp_path, mode)
    assert out.xy[:, 0] == pytest.approx([*ends, (ends or [0])[-1] + 5])
    assert (out.variable("A"), out.variable("B")) == (1, 1)
    assert all(out.moves["flags"] & EXACT_STOP)
    if mode == 0:
        assert out.moves["feed"] * 60 == pytest.approx([1000, 100, 100, 1000])


def test_the_fast_search_overruns_the_sensor(tmp_path):
    """By its braking distance: RZERO_ACC in increments per sample squared."""
    out = homed(tmp_path, 0, "RZERO_ACC_X = 10\n")
    overrun = (1000 / 60) ** 2 / (2 * 400)
    assert out.xy[:, 0] == pytest.approx([-20 - overrun, -19.9, -20, -15])


def test_absolute_encoder(tmp_path):
    """Mode 64: no search, the encoder says the position; RZERO_OFFSET is
    driven, RZERO_PRESET counts if given.
    """
    config = "[isons]\nRZERO_MODE_X = 64\n"
    assert (
        run(tmp_path, "G1X7F1\nG71X\n$A=$_Q0\n", config + SENSORS).variable("A")
        == 3
    )
    out = run(
        tmp_path,
        "G1X7F1\nG71X\n$A=$_Q0\n",
        config + "RZERO_OFFSET_X = 2000\n" + SENSORS,
    )
    assert (out.variable("A"), out.xy[-1, 0]) == (5, 9)
    with pytest.raises(CncError, match="no absolute encoder") as caught:
        run(tmp_path, "G71X\n", config)
    assert caught.value.code == 1005


def test_methods_that_nobody_has(tmp_path):
    """A method the drive does not have is refused by name, a mode that is none
    by the cell file and WRITE_PARMAC.
    """
    for method in (0, 7, 23, 36, 100):
        with pytest.raises(
            CncError,
            match=f"RZERO_MODE {128 + 256 * method}: .*no homing method {method}",
        ) as caught:
            homed(tmp_path, 128 + 256 * method)
        assert (caught.value.code, caught.value.place.line) == (909161, 1)
    for mode in (-1, 10, 31, 33, 65, 129, 256, 0.5):
        with pytest.raises(
            ConfigError, match=f"isons: machine parameter RZERO_MODE_X.*{mode}"
        ) as wrong:
            parse_config(
                f"[axes.X]\n[axes.Y]\n[isons]\nRZERO_MODE_X = {mode}\n",
                "cell.toml",
            )
        assert (wrong.value.place.file, wrong.value.place.line) == (
            "cell.toml",
            4,
        )
        with pytest.raises(CncError) as caught:
            run(tmp_path, f'WRITE_PARMAC "RZERO_MODE_X" {mode}\n')
        assert caught.value.code == 900012


def test_homing_that_finds_nothing(tmp_path):
    """Error 1005 of the guide says what is missing."""
    for mode, missing in (
        (0, "negative home sensor"),
        (9, "encoder index"),
        (128 + 256, "limit_negative"),
        (128 + 256 * 18, "limit_positive"),
        (128 + 256 * 19, "positive home sensor"),
    ):
        with pytest.raises(CncError, match=missing) as caught:
            run(tmp_path, "G71X\n", f"[isons]\nRZERO_MODE_X = {mode}\n")
        assert (caught.value.code, caught.value.place.line) == (1005, 1)
    with pytest.raises(CncError, match=r"TIME_OUT_HOME \(") as caught:
        homed(tmp_path, 0, "TIME_OUT_HOME = 100\n")
    assert caught.value.code == 1005


def test_t30_probing(tmp_path):
    """T-30: the sensor stands at 62, the program goes on from there; without it the error."""
    probe = "[probe]\nX = 62.0\n"
    out = run(
        tmp_path,
        "G102 X100\n$B=$_Q0\nG92X\n$A=$_Q0\nG1X1\n",
        "[isons]\nACQ_VEL = 300\n" + probe,
    )
    assert out.xy[:, 0].tolist() == [62, 63]
    assert out.moves["feed"][0] == pytest.approx(5)
    assert (out.variable("A"), out.variable("B")) == (0, 62)
    assert (
        run(tmp_path, "G94X10\nG91\nG102 X100\n$A=$_Q0\n", probe).variable("A")
        == 52
    )
    assert run(tmp_path, "G102 X100 Y50\n", probe).xy[
        0
    ].tolist() == pytest.approx([62, 31])
    for config in ("", "[probe]\nX = 162.0\n"):
        with pytest.raises(CncError, match="ACQ SENSOR ERROR") as caught:
            run(tmp_path, "G0X1\nG102 X100\n", config)
        assert caught.value.place.line == 2
    with pytest.raises(ConfigError):
        run(tmp_path, "", "[probe]\nQ = 1.0\n")


def test_t27_commands_keep_their_place_without_a_stop(tmp_path):
    """T-27: event 1 behind (130, 110), event 0 behind (210, 180)."""
    text = "G60 G1X100Y100F1\nX120Y110\nX130\nG100X1\nX200Y160\nX210Y180\nG100X0\nX300Y200\n"
    rows = run(tmp_path, text, "[isons]\nSGLP = 900\n").rows
    events = rows["type"] == EVENT
    assert [
        (int(code), value)
        for code, value in rows[["code", "value"]][events].tolist()
    ] == [
        (EVENT_COMMAND, 1),
        (EVENT_COMMAND, 0),
    ]
    before = [rows["end"][i - 1, :2].tolist() for i in events.nonzero()[0]]
    assert before == [[130, 110], [210, 180]]
    assert not rows["flags"][~events].any()


@pytest.mark.parametrize("before", ["", "G24\n"])
@pytest.mark.parametrize("line", ["G2R5", "G3 R-5 F2"])
def test_a_radius_without_end_point_is_refused(tmp_path, before, line):
    """R cannot give a full circle: G2 R5 alone is not passed over, on whichever
    way the line is read.
    """
    with pytest.raises(CncError) as error:
        run(tmp_path, f"{before}G1X10F1\n{line}\nX20\n")
    assert (error.value.code, error.value.place.line) == (
        900007,
        2 + before.count("\n"),
    )


@pytest.mark.parametrize(
    ("dialect", "stop"),
    [
        ("isons", "G80"),
        ("isons", "M0"),
        ("isg", "M0"),
        ("iso", "M1\nM0"),
        ("osai", "M0"),
    ],
)
@pytest.mark.ci_cases
def test_planning_takes_stops_as_acknowledged(tmp_path, dialect, stop):
    """Without a PLC nobody continues a program stop: the plan stands there once
    and goes on to the end.
    """
    (tmp_path / "a.nc").write_text(f"G1 X10 F2\n{stop}\nG1 X20\n")
    cell = load_config(None)
    result = plan_program(
        Program(tmp_path / "a.nc", cell, dialect=dialect), keep_samples=True
    )
    way, speed = result.samples["pos"][:, 0], result.samples["v"]
    assert way[-1] == pytest.approx(20)
    assert min(speed[(way > 9) & (way < 11)]) < 0.1


def test_a_negative_waiting_time_is_refused(tmp_path):
    """Only 0 waits for ever: a negative time, whose place is known, does not hang a run."""
    with pytest.raises(CncError) as error:
        run(tmp_path, "G1X1F1\nWAIT_INPUT 2 1 -1 12\n")
    assert (error.value.code, error.value.place.line) == (900012, 2)
