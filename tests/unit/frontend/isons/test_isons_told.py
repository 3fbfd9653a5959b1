"""What an expert missed: words that were accepted wrongly, values that changed
nothing in silence, numbers that came out otherwise than the guide says.
"""

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.isons_programs import run


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("DIM $A[3]\n$A[1]=5\nDIM $A[4]\n", 907017, 3),
        ("DIM $A[2] $A[2]\n", None, 0),
        ("@B\nDIM $A[3]\n$N=$N+1\nIF $N<3\nGOTO B\nEND_IF\n", None, 0),
        ("LOOP 2\nDIM $A[3]\nEND_LOOP\n", 907017, 2),
        ("LOOP 1\nDIM $A[3]\nEND_LOOP\n", None, 0),
        (
            "LOOP 2\nGOSUB S\nEND_LOOP\nEND_PROGRAM\n@S\nDIM $A[3]\nRETURN\n",
            907017,
            6,
        ),
        ("G41\nG1X5F1\n", 906007, 1),
        ("D2\nG41\nG1X5F1\nX9\nG40\nX12\n", None, 0),
        ("GOTO 10\nN10 G1X1F1\nN10 G1X2\n", 907025, 1),
        ("IF 1>2\nGOSUB @10\nEND_IF\nN10 G1X1F1\nN010 X2\n", 907025, 2),
        ("IF 1>2\nGOTO 7\nEND_IF\nN10 G1X1F1\n", 907023, 2),
        ("@10\nN10 G1X1F1\nN10 X2\nIF 1>2\nGOTO 10\nEND_IF\n", None, 0),
        ("N10 G1X1F1\nN10 G1X2\nGOTO E\n@E\n", None, 0),
        ("GOTO 10\nN10 G1X1F1\nN100 G1X2\nN11 G1X3\n", None, 0),
        ("$A=²\n", 900004, 1),
        ("N٣ G1X1F1\n", 900001, 1),
        ("M٣\n", 900004, 1),
    ],
)
def test_refusals(tmp_path, text, code, line):
    """Each with its number and line; what is right stays accepted."""
    if code is None:
        run(tmp_path, text)
        return
    with pytest.raises(CncError) as caught:
        run(tmp_path, text)
    assert (caught.value.place.line, caught.value.code) == (line, code)


@pytest.mark.parametrize(("end", "told"), [("", 1), ("G40\nX12\n", 0)])
def test_a_program_that_ends_compensated_is_told(tmp_path, end, told):
    """G40 is missing: a warning."""
    out = run(tmp_path, f"D2\nG41\nG1X5F1\nX9\n{end}")
    assert sum("906008" in one for one in out.port.messages) == told


def test_arguments_of_a_macro_end_at_blanks(tmp_path):
    """`HM8 $A+1 [$A*5] 3` has three; a sign behind a blank begins the next."""
    files = {"HM8.isons": "GLOBAL $S\nGET $R $Q $P\n$S=$P*100+$Q*10+$R\n"}
    text = "GLOBAL $S\n$A=1\nHM8 {}\n"
    for words, value in (
        ("$A+1 [$A*5] 3", 253),
        ("$A -1 2", 92),
        ("-$A*2 3-1 [4+1]", -175),
    ):
        out = run(tmp_path, text.format(words), files=files)
        assert out.reader.store.common.values["S"] == value


def test_source_takes_a_variable_or_a_whole_number(tmp_path):
    """A button copies one of them, 1.5 is neither."""
    text = "LIB_ADDBUTTON B\nLIB_BUTTONPROP B SOURCE {}\n"
    with pytest.raises(CncError, match="whole number"):
        run(tmp_path, text.format("1.5"))


@pytest.mark.parametrize(
    ("code", "told"),
    [("G80X4", "clamp"), ("G80X5", "NO CODE PAUSE"), ("G80", "NO CODE PAUSE")],
)
def test_text_of_a_forced_pause(tmp_path, code, told):
    """The cell has texts by code; without one the guide's words."""
    out = run(tmp_path, f"{code}\n", '[isons.pauses]\n4 = "clamp"\n')
    assert out.port.messages == [told]


def test_a_file_that_is_missing_is_told_with_its_path(tmp_path):
    """$APPPATH is written out."""
    with pytest.raises(CncError, match=r"lib/b\.isons") as caught:
        run(
            tmp_path,
            'IMPORT "$APPPATH/b.isons"\n',
            '[isons]\napp_path = "lib"\n',
        )
    assert "$APPPATH" not in caught.value.text


def test_homing_runs_until_its_time_is_over(tmp_path):
    """TIME_OUT_HOME stops the search where it has come to by then."""
    config = (
        "[isons]\nRZERO_MODE_X = 0\nRZERO_VEL_X = 600\nTIME_OUT_HOME = 500\n"
        "[isons.homing.X]\nnegative = -20.0\n"
    )
    (tmp_path / "p.isons").write_text("G71X\n")
    program = Program(tmp_path / "p.isons", parse_config(config))
    rows = []
    with pytest.raises(CncError) as caught:
        rows += [row for batch in program.batches() for row in batch.rows]
    program.reader.close()
    assert caught.value.code == 1005


DRIVE = "G60G63F6\nG0X100\nG1X0\n"


def driven(folder, text, config):
    """Seconds of the rapid and of the whole program."""
    (folder / "p.isons").write_text(text)
    program = Program(folder / "p.isons", parse_config(config))
    return plan_program(program).motion_time_s


def test_rapids_have_their_own_speed_and_acceleration(tmp_path):
    """VMAXG0 is a share of VMAX, ACC_G0 an acceleration of its own, JERK the
    samples in which it is reached: closed formulas of a line from rest to rest.
    """
    base = "[isons]\nVMAX_X = 6000\nACC_LAV = 50\nJERK = 0\n"
    one = "G0X100\n"

    def trapeze(speed, accel):
        return 100.0 / speed + speed / accel

    for keys, wanted in (
        ("", trapeze(100, 2000)),
        ("VMAXG0 = 40\n", trapeze(40, 2000)),
        ("ACC_G0 = 10\n", trapeze(100, 400)),
        ("ACC_G0 = 100\n", trapeze(100, 4000)),
    ):
        assert driven(tmp_path, one, base + keys) == pytest.approx(
            wanted, rel=2e-3
        )
    feed = "G1X100F100\n"
    plain = driven(tmp_path, feed, base)
    assert driven(tmp_path, feed, base + "ACC_G0 = 100\n") == pytest.approx(
        plain, rel=1e-3
    )
    soft = base.replace("JERK = 0", "JERK = 20")  # 0.1 s
    assert driven(tmp_path, one, soft) == pytest.approx(
        trapeze(100, 2000) + 0.1, rel=0.02
    )


def test_a_written_vmax_acts(tmp_path):
    """WRITE_PARMAC lowers the speed of what follows, feed and rapid."""
    base = "[isons]\nVMAX_X = 6000\nACC_LAV = 50\nJERK = 0\n"
    text = 'WRITE_PARMAC "VMAX_X" 600\n{}\n'
    for motion in ("G0X100", "G1X100F100"):
        found = driven(tmp_path, text.format(motion), base)
        assert found == pytest.approx(10.0, rel=5e-3)


def test_parameters_without_effect_are_told_once(tmp_path):
    """Of the cell with their reason, written by a program once a name."""
    cell = parse_config("[isons]\nGANTRY_X = 1\nVJOG_Y = 5\nPID_KP_X = 0\n")
    told = cell.warnings()
    assert [w.split(" has no effect: ")[0] for w in told] == [
        "isons.GANTRY_X",
        "isons.VJOG_Y",
    ]
    text = 'WRITE_PARMAC "BACKLASH_X" 1\nWRITE_PARMAC "BACKLASH_X" 2\n'
    out = run(tmp_path, text + 'WRITE_PARMAC "FEEDMAX" 2\n')
    assert sum("907042" in one for one in out.port.messages) == 1
    assert np.isfinite(out.reader.channel.parameters["FEEDMAX"])


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("LIB_ADDLABLE L\n", "LIB_ADDLABEL"),
        ("LIB_ADDLABEL L\nLIB_LABELPROP L VISIBEL 1\n", "VISIBLE"),
        ("$A=SQRT(4)\n", "SQR"),
        ("G1X[2+SINN(4)]F1\n", "SIN"),
        ("IF COZ(4)>0\nEND_IF\n", "COS"),
        ("OPT M_STP 3\n", "M_STOP"),
    ],
)
def test_every_word_has_a_guess(tmp_path, text, meant):
    """Instructions of forms, properties and functions, too."""
    with pytest.raises(CncError, match=f"did you mean {meant}"):
        run(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("Q\n", "Q: no function has this letter"),
        ("X5 5\n", "5: no letter stands in front of the number"),
        ("$A=FOO(3)\n", "unknown function FOO"),
        ("$A=SIN 3\n", "SIN: its argument stands in"),
    ],
)
def test_a_word_without_a_guess_says_why(tmp_path, text, why):
    """Nothing that is far from it is proposed."""
    with pytest.raises(CncError) as caught:
        run(tmp_path, text)
    assert why in caught.value.text
    assert "did you mean" not in caught.value.text


@pytest.mark.parametrize("text", ['READ_PARMAC "SGLP"\n'])
def test_a_missing_variable_is_told(tmp_path, text):
    """The end of the block is named as such."""
    with pytest.raises(CncError, match="found the end of the block"):
        run(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("LOOP\n$A=1\nEND_LOOP\n", 900004, 1),
        ("LOOP 3 X\n$A=1\nEND_LOOP\n", 900010, 1),
        ("$A=4\nLOOP SQR(0-$A)\n$B=1\nEND_LOOP\n", 900012, 2),
        ("LOOP 2\nIF 1>2\nLOOP\nEND_LOOP\nEND_IF\nEND_LOOP\n", 900004, 3),
        ("LOOP 2\nLOOP 1.5\n$A=1\nEND_LOOP\nEND_LOOP\n", 909105, 2),
        ("LOOP\nGOTO B\n@B\nEND_LOOP\n", 900004, 1),
    ],
)
def test_a_wrong_loop_is_one_error(tmp_path, text, code, line):
    """Its END_LOOP, and jumps in its body, are not wrong too."""
    errors = run(tmp_path, text, collect=True).errors
    assert [(e.code, e.place.line) for e in errors] == [(code, line)]


def test_dx_is_a_line_as_under_g91(tmp_path):
    """The same end to the last bit, behind an origin and in inches too."""
    head = "G94X0.1Y7.3\nG20\nF1\nG1X0.7Y0.3\n"
    with_d = run(tmp_path, head + "DX0.1DY-0.3\nX1\n").ends
    under = run(tmp_path, head + "G91\nX0.1Y-0.3\nG90\nX1\n").ends
    assert with_d.tobytes() == under.tobytes()
