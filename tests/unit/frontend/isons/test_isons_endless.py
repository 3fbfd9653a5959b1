"""IsoNs programs that go round for ever are found, programs that only take long are not."""

import pytest

from cnc_core.errors import CncError
from cnc_core.frontend.isons import front_end
from cnc_core.frontend.isons.flow import endless
from support.isons_programs import run

STILL = [
    "@A\nGOTO A\n",
    "@A\nGOSUB S\nGOTO A\n@S\n$A=1\nRETURN\n",
    "@A\nM3\nG4F0.1\nGOTO 1\n",
    "@A\nIF $_I0=1\nGOTO B\nEND_IF\n$_O1=1-$_O1\nGOTO A\n@B\n",
    "$K=0\n@A\n$K=1-$K\nGOTO A\n",
    "@A\nPA[0] 10\nPA[0] 0\nGOTO A\n",
]


@pytest.mark.parametrize("text", STILL)
@pytest.mark.parametrize("collect", [True, False])
def test_programs_that_go_round_without_motion(tmp_path, text, collect):
    """State and place come again: error 907001 after a few passes, in ``check`` too."""
    if collect:
        assert [
            error.code for error in run(tmp_path, text, collect=True).errors
        ] == [907001]
        return
    with pytest.raises(CncError) as caught:
        run(tmp_path, text)
    assert (caught.value.code, "comes back" in str(caught.value)) == (
        907001,
        True,
    )


def test_a_counting_loop_ends_by_number_of_blocks(tmp_path, monkeypatch):
    """A variable that counts never comes again: the number of blocks without a row ends it."""
    monkeypatch.setattr(front_end, "IDLE_BLOCKS", 3000)
    with pytest.raises(CncError) as caught:
        run(tmp_path, "LOOP 100000\n$A=$A+1\nEND_LOOP\n")
    assert (caught.value.code, "3000" in str(caught.value)) == (907001, True)


def test_endless_motion_ends_the_check_with_a_warning(tmp_path):
    """Parts without end are no mistake; what stands behind the jump is
    compiled, subprograms there are no error.
    """
    out = run(
        tmp_path,
        "@A\nG1X10\nX0\nGOTO 1\nG1X5 Q\n@S\nG1Y9\nRETURN\n",
        collect=True,
    )
    assert [(error.code, error.place.line) for error in out.errors] == [
        (900001, 5)
    ]
    assert [warning.code for warning in out.reader.warnings] == [909173]
    with pytest.raises(CncError) as caught:
        run(tmp_path, "@A\nG1X10\nX0\nGOTO 1\n")
    assert caught.value.code == 907001


def test_a_counted_endless_program_is_not_followed_for_ever(
    tmp_path, monkeypatch
):
    """Every pass differs: after a number of jumps the check gives up with a warning."""
    monkeypatch.setattr(endless, "PASSES_CHECKED", 50)
    out = run(tmp_path, "@A\nG91\nG1X1\nGOTO A\n", collect=True)
    assert (out.errors, [warning.code for warning in out.reader.warnings]) == (
        [],
        [909173],
    )


def test_a_counted_endless_program_is_not_planned_for_ever(tmp_path):
    """Where no machine drives, isons.passes_max jumps back are the end, and it
    is said so; LOOPs do not count.
    """
    text = "@A\nG91\nG1X1\nLOOP 90\n$A=$A+1\nEND_LOOP\nGOTO A\n"
    with pytest.raises(CncError) as caught:
        run(tmp_path, text, "[isons]\npasses_max = 70\n")
    assert (
        caught.value.code,
        "70 times (isons.passes_max" in str(caught.value),
    ) == (907001, True)
    long = "@A\nG91\nG1X1\n$N=$N+1\nIF $N<{}\nGOTO A\nEND_IF\n"
    assert (
        len(run(tmp_path, long.format(70), "[isons]\npasses_max = 70\n").moves)
        == 70
    )
    assert (
        len(run(tmp_path, long.format(200), "[isons]\npasses_max = 0\n").moves)
        == 200
    )


@pytest.mark.parametrize(
    "text",
    [
        "$N=0\n@A\n$N=$N+1\nIF $N<500\nGOTO A\nEND_IF\nG1X1\n",
        "@A\nG91\nG1X1\nG90\nIF $_C0<300\nGOTO A\nEND_IF\n",
        "$_T0=200\n@A\nIF $_T0>0\nGOTO A\nEND_IF\nG1X1\n",
        "DIM $A[3]\n@A\n$A[1]=$A[1]+1\nIF $A[1]<100\nGOTO A\nEND_IF\n",
        "@A\nADD_VAR 1\nCOUNT_VAR $C\nIF $C<100\nGOTO A\nEND_IF\n",
        "@A\nG92X\nG91\nG1X1\nG90\nIF $_Y0<50\nGOTO A\nEND_IF\n",
        "@A\n$_K3=$_K3+1\nIF $_K3<90\nGOTO A\nEND_IF\n",
        "@A\nF[$_X8+1]\nIF $_X8<90\nGOTO A\nEND_IF\n",
        "T1\n@A\n$_U5=$_U5+1\nIF $_U5<90\nGOTO A\nEND_IF\n",
        "PF[0] 600\nPA[0,0] 5\n@A\nIF $_PM[0,0]=1\nGOTO A\nEND_IF\n",
    ],
)
def test_programs_that_change_something_are_left_alone(tmp_path, text):
    """Variables, position, timers, arrays, the list, origins, generic
    variables, feed, tables, positioners.
    """
    assert (
        run(tmp_path, text, "[isons]\npositioners = 2\n", collect=True).errors
        == []
    )


def test_long_loops_are_followed_to_their_end(tmp_path, monkeypatch):
    """LOOP ends by itself, however often it comes back."""
    monkeypatch.setattr(endless, "PASSES_CHECKED", 50)
    out = run(tmp_path, "LOOP 300\nG1DX1\nEND_LOOP\nG1X5 Q\n", collect=True)
    assert (
        [error.code for error in out.errors],
        out.reader.warnings,
        len(out.moves),
    ) == ([900001], [], 300)
