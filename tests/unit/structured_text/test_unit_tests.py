"""Tests written in Structured Text, in the habits of the common frameworks."""

from __future__ import annotations

from pathlib import Path

import pytest

from plc_client.st import testing

SUITE = """FUNCTION_BLOCK FB_Ramp
VAR_INPUT target : REAL; END_VAR
VAR_OUTPUT value : REAL; END_VAR
IF value < target THEN value := value + 1; END_IF
END_FUNCTION_BLOCK

{attribute 'call_after_init'}
FUNCTION_BLOCK FB_Ramp_Test EXTENDS TcUnit.FB_TestSuite
VAR
  ramp : FB_Ramp; timer : TON; n : INT;
  a : ARRAY [1..3] OF INT := [1, 2, 3]; b : ARRAY [0..2] OF INT := [1, 2, 4];
END_VAR
Reaches();
Fails();

METHOD PRIVATE Reaches
TEST('Reaches');
ramp(target := 5.0);
n := n + 1;
timer(IN := TRUE, PT := T#20ms);
IF timer.Q THEN
  AssertEquals_REAL(Expected := 5.0, Actual := ramp.value, Delta := 0.01, Message := 'value');
  AssertEquals_INT(21, n, 'scans');
  TEST_FINISHED();
END_IF
END_METHOD

METHOD Fails
IF TEST_ORDERED('Fails') THEN
  AssertEquals_STRING('abc', 'abd', 'text');
  AssertArrayEquals_INT(Expecteds := a, Actuals := b, Message := 'arrays');
  TEST_FINISHED();
END_IF
END_METHOD

METHOD Never
TEST('Never');
IF FALSE THEN TEST_FINISHED(); END_IF
END_METHOD

METHOD PRIVATE helper : INT
VAR_INPUT x : INT; END_VAR
helper := x;
END_METHOD
END_FUNCTION_BLOCK

PROGRAM PRG_TEST
VAR suite : FB_Ramp_Test; END_VAR
TcUnit.RUN();
END_PROGRAM
"""


@pytest.fixture
def suite(tmp_path: Path) -> Path:
    """A file with a suite."""
    path = tmp_path / "test_ramp.st"
    path.write_text(SUITE)
    return path


def test_a_method_that_calls_test_is_one(suite: Path) -> None:
    """Its name is free; a helper is none."""
    methods = [test.method for test in testing.tests_of(suite)]
    assert methods == ["Reaches", "Fails", "Never"]


def test_a_test_may_take_many_scans(suite: Path) -> None:
    """It runs in each scan until TEST_FINISHED."""
    testing.run_test(suite, "FB_Ramp_Test", "Reaches", lasts=True)


def test_failures_tell_line_and_values(suite: Path) -> None:
    """Arrays tell the element."""
    with pytest.raises(testing.StTestFailedError) as told:
        testing.run_test(suite, "FB_Ramp_Test", "Fails", lasts=True)
    lines = str(told.value).splitlines()
    assert lines[0].endswith(
        "test_ramp.st:30: FB_Ramp_Test.Fails: text: expected abc, found abd"
    )
    assert "test_ramp.st:31" in lines[1]
    assert "element [3]: expected 3, found 4" in lines[1]


@pytest.mark.ci
def test_a_test_that_never_finishes_fails(suite: Path) -> None:
    """After a minute of the cell's clock."""
    with pytest.raises(testing.StTestFailedError, match="no TEST_FINISHED"):
        testing.run_test(suite, "FB_Ramp_Test", "Never", lasts=True)


EVERY_KIND = """FUNCTION_BLOCK FB_Kinds EXTENDS FB_TestSuite
METHOD Test_Kinds
VAR
  l : LTIME := LTIME#1D2US; d : DATE := D#2024-02-29; t : TOD := TOD#12:30:00;
  dt1 : DT := DT#1996-05-06-15:36:30; w : WSTRING := "wide"; b : BYTE := 3;
END_VAR
TEST('Kinds');
AssertEquals(Expected := l, Actual := l, Message := 'LTIME');
AssertEquals(Expected := d, Actual := d, Message := 'DATE');
AssertEquals(Expected := t, Actual := t, Message := 'TOD');
AssertEquals(Expected := dt1, Actual := dt1, Message := 'DT');
AssertEquals(Expected := w, Actual := w, Message := 'WSTRING');
AssertEquals(Expected := b, Actual := BYTE#4, Message := 'BYTE');
AssertEquals_DATE_AND_TIME(dt1, dt1, 'DT');
AssertEquals_TIME_OF_DAY(t, t, 'TOD');
AssertFalse(IS_TEST_FINISHED('Kinds'), 'before');
TEST_FINISHED();
AssertTrue(IS_TEST_FINISHED('Kinds'), 'behind');
AssertFalse(IS_TEST_FINISHED('Other'), 'another');
END_METHOD
END_FUNCTION_BLOCK
"""


def test_assert_equals_takes_every_elementary_type(tmp_path: Path) -> None:
    """The one pair that differs is told, with the line of its call."""
    path = tmp_path / "test_kinds.st"
    path.write_text(EVERY_KIND)
    with pytest.raises(testing.StTestFailedError) as caught:
        testing.run_test(path, "FB_Kinds", "Test_Kinds")
    (line,) = str(caught.value).splitlines()
    assert ":13:" in line
    assert "BYTE: expected 3, found 4" in line
