"""IsoNs programs through the command line, and with a PLC that answers their outputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from support.command_line import Outcome
from support.paths import PLC_PROGRAMS

PLC = PLC_PROGRAMS / "isons_inputs.py"
Cli = Callable[..., Outcome]
Write = Callable[..., Path]


@pytest.mark.ci
def test_inputs_and_outputs_reach_the_plc(cli: Cli, program: Write) -> None:
    """WAIT_INPUT sees the PLC's answer to an output, $_K its numbers; then an
    input that does not come: the alarm.
    """
    part = program(
        "F6\n$_O5=1\n$_K0=21\nG1X5\nWAIT_INPUT 2 1 5 9\nADD_VAR $_K1\n"
        "ADD_VAR $_R0\n$_O5=0\nG4F0.1\nG62\n"
        'ADD_VAR $_I2\nSAVE_VAR "seen.txt"\nWAIT_INPUT 2 1 0.3 12\nG0X0\n',
        "part.isons",
    )
    outcome = cli(
        "run", part, "--plc", PLC, "--json", "--out", part.parent / "out"
    )
    run = outcome.json
    assert [(e["code"], e["line"]) for e in run["errors"]] == [(909131, 13)], (
        outcome.err
    )
    assert "alarm 12" in run["errors"][0]["text"]
    assert run["files"] == ["seen.txt"]
    seen = [
        float(line)
        for line in (part.parent / "out" / "seen.txt").read_text().split()
    ]
    assert seen == [42.0, pytest.approx(5.0), 0.0]


@pytest.mark.ci
def test_timers_count_machine_time(cli: Cli, program: Write) -> None:
    """T-10: a timer of 1500 ms stands at 0 after 1.5 s; a positioner takes its time."""
    part = program(
        "$_T0=1500\nG4F1\n@W\nIF $_T0>0\nGOTO W\nEND_IF\nPF[0] 600\nPA[0] 5\nG0X1\n",
        "part.isons",
    )
    run = cli("run", part, "--json").json
    assert run["end"] == "completed"
    assert 2.0 < run["sim_time_s"] < 2.2


def test_blocks_and_check(cli: Cli, program: Write) -> None:
    """T-01 as blocks, found to be this dialect by its content; all errors of a
    wrong program with their places.
    """
    part = program("$A=100\nG90 G1X[$A]Y100\nG91 X5Y-3\nG90 X0Y0\n")
    ends = [row["end"] for row in cli("blocks", part, "--json").lines]
    assert [(end["X"], end["Y"]) for end in ends] == [
        (100, 100),
        (105, 97),
        (0, 0),
    ]
    wrong = program(
        "LOOP 2.5\nEND_LOOP\nGOTO NO\nG104\nG2X5R0\n", "wrong.isons"
    )
    outcome = cli("check", wrong, "--json")
    assert [(e["code"], e["line"]) for e in outcome.json["errors"]][:3] == [
        (909105, 1),
        (907023, 3),
        (910106, 4),
    ]
    assert outcome.status == 1


T31 = """G60 F1
G1X100
@LOOP
IF $_I0 = 1
GOTO STOP
END_IF
IF $_Q0 = 100
GOTO ERR
END_IF
GOTO LOOP
@STOP
G101
ADD_VAR $_Q0
ADD_VAR $_C0
SAVE_VAR "at.txt"
G1Y10
END_PROGRAM
@ERR
ERROR 5
"""


@pytest.mark.ci
def test_t31_the_axes_stop_where_they_are(cli: Cli, program: Write) -> None:
    """T-31: G101 when the input trips at 40; the program goes on from there.
    Without it the error path at 100.
    """
    part = program(T31, "part.isons")
    trip = PLC_PROGRAMS / "isons_trip.py"
    run = cli(
        "run", part, "--plc", trip, "--json", "--out", part.parent / "out"
    ).json
    assert run["end"] == "completed", run["errors"]
    demand, counter = (
        float(line)
        for line in (part.parent / "out" / "at.txt").read_text().split()
    )
    assert 40 < demand < 42
    assert counter == demand
    run = cli(
        "run",
        program(
            T31.replace("X100", "X30").replace("= 100", "= 30"), "part.isons"
        ),
        "--json",
    ).json
    assert [(e["code"], e["line"]) for e in run["errors"]] == [(909130, 19)]


def test_t27_commands_on_the_path(cli: Cli, program: Write) -> None:
    """T-27: events 1 and 0 where they stand in the path."""
    text = "G60 G1X100Y100F10\nX120Y110\nX130\nG100X1\nX140Y115\nX150Y120\nG100X0\nX160Y125\n"
    run = cli(
        "run", program(text, "part.isons"), "--plc", "none", "--json"
    ).json
    assert run["end"] == "completed"
    assert [message.split(",")[0] for message in run["messages"]] == [
        "event 1 at X130.0000 Y110.0000 Z0.0000",
        "event 0 at X150.0000 Y120.0000 Z0.0000",
    ]


def test_a_dialog_without_answers_ends_the_run(
    cli: Cli, program: Write
) -> None:
    """Error 909152 with its place; answered by a script it goes on."""
    part = program(
        'G1X1\nLIB_MESSAGE "go on?" "cap" 1 3\nIF $_X13=1\nG1X5\nEND_IF\n',
        "part.isons",
    )
    run = cli("run", part, "--plc", "none", "--json").json
    assert [(e["code"], e["line"]) for e in run["errors"]] == [(909152, 2)]
    (part.parent / "answers.json").write_text('["YES"]')
    run = cli(
        "run",
        part,
        "--plc",
        "none",
        "--json",
        "--answers",
        part.parent / "answers.json",
    ).json
    assert (run["end"], run["blocks"]) == ("completed", 2)


@pytest.mark.parametrize("from_hold", [False, True])
def test_a_stop_executes_its_macro(
    cli: Cli, program: Write, monkeypatch: pytest.MonkeyPatch, from_hold: bool
) -> None:
    """The PLC stops the program: the axes brake, M_STOP is executed from there,
    the run ends as aborted.
    """
    part = program("OPT M_STOP 20\nF6\nG1X50\nX90\n", "part.isons")
    (part.parent / "M20.isons").write_text(
        'ADD_VAR $_Q0\nG0Z5\nADD_VAR $_R2\nSAVE_VAR "at.txt"\n'
    )
    if from_hold:
        monkeypatch.setenv("HLI_COSIM_STOP_FROM_HOLD", "1")
    plc = PLC_PROGRAMS / "isons_stop.py"
    run = cli(
        "run", part, "--plc", plc, "--json", "--out", part.parent / "out"
    ).json
    assert run["end"] == "aborted"
    x, z = (
        float(line)
        for line in (part.parent / "out" / "at.txt").read_text().split()
    )
    assert 10 < x < 20
    assert z == 5


PAUSED = PLC_PROGRAMS / "isons_pause.py"
MACROS = {
    "M30.isons": "GLOBAL $X $Y\n$X=$_Q0\n$Y=$_Q1\nG0Z5\nG0X-3\n",
    "M31.isons": 'GLOBAL $X $Y\nG1X[$X]Y[$Y]\nG62\nADD_VAR $_C0-$_Q0\nSAVE_VAR "back.txt"\n',
}


WAVE = "G1\n" + "".join(
    f"X{x:.2f}Y{3 - 3 * np.cos(x / 4):.3f}\n" for x in np.arange(0.4, 40, 0.4)
)
PATHS = [
    "G1X40\nG2X60Y20R20\nG1Y50\n",
    "G2X40Y0R20\nG1Y9\n",
    "G61\nG1X30\nG62\nG1Y20\n",
]
PATHS += [
    "G69X200\nG72X1Y1Z4A0.3\n" + WAVE,
    '$M=300\nWRITE_PARMAC "MILD_X" $M\nG63\nG49X\n' + WAVE,
]


@pytest.mark.ci
@pytest.mark.parametrize("path", PATHS)
def test_a_pause_with_macros(cli: Cli, program: Write, path: str) -> None:
    """HOLD: M_PAUSE parks; ACTIVE: M_GOPAUSE, back at VRIPOSO, then the rest of
    the path, cut where it was left.
    """
    part = program(
        "OPT M_PAUSE 30\nOPT M_GOPAUSE 31\nG60 F6\n" + path, "part.isons"
    )
    for name, text in MACROS.items():
        (part.parent / name).write_text(text)
    recorded = part.parent / "run.npz"
    outcome = cli(
        "run",
        part,
        "--plc",
        PAUSED,
        "--json",
        "--out",
        part.parent / "out",
        "--record",
        recorded,
    )
    assert outcome.json["end"] == "completed", outcome.err
    assert outcome.json["plc"]["result"]["states"][:6] == [3, 4, 13, 5, 11, 4]
    assert float(
        (part.parent / "out" / "back.txt").read_text()
    ) == pytest.approx(0, abs=1e-9)
    driven = np.load(recorded)["pos"]
    assert driven[:, 2].max() == pytest.approx(5, abs=1e-6)
    away = (driven[:, 2] > 1e-9) | (driven[:, 0] < -1e-9)
    whole = cli(
        "run",
        part,
        "--plc",
        "none",
        "--json",
        "--out",
        part.parent / "out",
        "--record",
        recorded,
    )
    assert whole.json["end"] == "completed"
    plain = np.load(recorded)["pos"]
    apart = [
        float(np.linalg.norm(plain - point, axis=1).min())
        for point in driven[~away][::20]
    ]
    assert (
        max(apart) < 0.2
    )  # the samples of the uninterrupted run are up to 0.1 mm apart
    assert driven[-1] == pytest.approx(plain[-1])


@pytest.mark.ci
@pytest.mark.parametrize(
    ("mode", "parked", "states"),
    [(3, False, [3, 4, 13, 5, 11, 4]), (4, False, [3, 4, 13, 4])],
)
def test_pause_modes(
    cli: Cli, program: Write, mode: int, parked: bool, states: list[int]
) -> None:
    """PAUSE_MODE 3 only stands still, 4 does not allow a pause: error 270061."""
    part = program(
        f"OPT M_PAUSE 30\nOPT M_GOPAUSE 31\nPAUSE_MODE {mode}\nF6\nG1X40\n",
        "part.isons",
    )
    for name, text in MACROS.items():
        (part.parent / name).write_text(text)
    recorded = part.parent / "run.npz"
    run = cli(
        "run",
        part,
        "--plc",
        PAUSED,
        "--json",
        "--out",
        part.parent / "out",
        "--record",
        recorded,
    ).json
    assert run["end"] == "completed"
    result = run["plc"]["result"]
    assert result["states"][: len(states)] == states
    assert result["errors"] == ([270061] if mode == 4 else [])
    assert (np.load(recorded)["pos"][:, 2].max() > 0) == parked


@pytest.mark.ci
def test_t27_events_reach_the_plc_where_the_path_passes_them(
    cli: Cli, program: Write
) -> None:
    """T-27: number 1 at (130, 110), 0 at (210, 180), in the order of the path, without a stop."""
    text = (
        "G60 G63 F3\nG1X100Y100\nX120Y110\nX130\nG100X1\nX200Y160\n"
        "X210Y180\nG100X0\nX300Y200\nG62\n"
        'ADD_VAR $_K0\nADD_VAR $_K1\nADD_VAR $_K2\nADD_VAR $_K3\nSAVE_VAR "seen.txt"\n'
    )
    part = program(text, "part.isons")
    plc = PLC_PROGRAMS / "isons_event.py"
    run = cli(
        "run", part, "--plc", plc, "--json", "--out", part.parent / "out"
    ).json
    assert run["end"] == "completed", run["errors"]
    seen = [
        float(line)
        for line in (part.parent / "out" / "seen.txt").read_text().split()
    ]
    first = 100 * 2**0.5 + np.hypot(20, 10) + 10
    second = first + np.hypot(70, 50) + np.hypot(10, 20)
    assert seen[::2] == [1.0, 0.0]
    assert seen[1::2] == pytest.approx([1000 * first, 1000 * second], abs=200.0)


@pytest.mark.ci
def test_a_retrace_ends_with_its_macro(cli: Cli, program: Write) -> None:
    """M_GORETRACE: outputs come as soon as the path is driven forward again,
    $_X7 is 3; it moves nothing.
    """
    part = program(
        "OPT M_GORETRACE 40\nGLOBAL $N\n$N=5\nG60F6\nG1X20\nX60\n", "part.isons"
    )
    macro = part.parent / "M40.isons"
    macro.write_text(
        'GLOBAL $N\n$_O3=1\nADD_VAR $_X7\nADD_VAR $N\nADD_VAR $_Q0\nSAVE_VAR "at.txt"\n'
    )
    plc = PLC_PROGRAMS / "isons_retrace.py"
    run = cli(
        "run", part, "--plc", plc, "--json", "--out", part.parent / "out"
    ).json
    assert run["end"] == "completed", run["errors"]
    kind, shared, place = (
        float(line)
        for line in (part.parent / "out" / "at.txt").read_text().split()
    )
    result = run["plc"]["result"]
    assert (kind, shared) == (3, 5)
    assert result["back"] < 15
    assert result["back"] - 0.01 <= place <= result["at"] < 16
    assert 0 < result["scans"] <= 4
    macro.write_text("$_O3=1\nG0Z5\n")
    run = cli(
        "run", part, "--plc", plc, "--json", "--out", part.parent / "out"
    ).json
    assert (run["end"], [error["code"] for error in run["errors"]]) == (
        "error",
        [909174],
    )


@pytest.mark.ci
def test_run_and_plan_count_the_same_blocks(cli: Cli, program: Write) -> None:
    """Blocks are those behind the filters, each once, though the smoothing drives it in pieces."""
    points = "".join(f"G1X{3 * i}Y{i % 2}\n" for i in range(12))
    part = program(f"G60 F1\nG0X0Y0\nG69X200\nG72X1Y7\n{points}", "part.isons")
    counts = {
        cli(name, part, "--json").json["blocks"]
        for name in ("check", "plan", "run")
    }
    assert len(counts) == 1
    assert counts.pop() > 100


@pytest.mark.ci
def test_a_counter_is_kept_from_run_to_run(
    cli: Callable[..., Outcome], program: Callable[..., Path], tmp_path: Path
) -> None:
    """LOAD_VAR and SAVE_VAR of the same file in the same folder, run by run."""
    first = program('ADD_VAR 1\nSAVE_VAR "count.txt"\n', "first.isons")
    again = program(
        'LOAD_VAR "count.txt"\nGET_VAR $B,0\n$B=$B+1\nWRITE_VAR $B,0\n'
        'SAVE_VAR "count.txt"\n',
        "again.isons",
    )
    for part in (first, again, again):
        done = cli("run", part, "--json")
        assert done.status == 0, done.err
    assert (tmp_path / "hli-cosim-out" / "count.txt").read_text() == "3.0\n"
