"""Operator dialogs of the IsoNs dialect: forms, messages, answers from a script."""

import json

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.frontend.isons.operator.colours import COLOURS
from cnc_core.frontend.isons.operator.forms import printed
from cnc_core.frontend.operator import Answer, Operator, read_answers
from cnc_core.frontend.port import OfflinePort
from cnc_core.process.live_port import LivePort
from cnc_core.program import Program
from support.isons_programs import CELL, run

FORM = """LIB_FORMTEXT "Tool data"
LIB_FORMPROP BACKCLOR 9
LIB_ADDLABEL L1
$V=103.2569
LIB_LABELPRINT L1 F1 $V
LIB_LABELPROP L1 FORECOLOR 113
LIB_ADDINPUT IN1
LIB_INPUTPROP IN1 MIN 0
LIB_INPUTPROP IN1 MAX 10
LIB_INPUTPROP IN1 DEST $D
LIB_ADDBUTTON B1
LIB_BUTTONPROP B1 DEST $P
LIB_BUTTONPROP B1 SOURCE 3
LIB_ADDBUTTON B2
LIB_BUTTONPROP B2 CLOSEFORM 1
LIB_SHOWFORM
"""


def answered(folder, text, answers):
    path = folder / "p.isons"
    path.write_text(text)
    port = OfflinePort(np.zeros(4), operator=Operator(answers))
    program = Program(path, parse_config(CELL), "isons", port)
    rows = [row for batch in program.batches() for row in batch.rows]
    return program.reader, port, rows


def test_t09_formats_and_colours():
    """T-09."""
    assert [printed(form, 103.2569, 0) for form in ("I", "F1", "F4")] == [
        "103",
        "103.2",
        "103.2569",
    ]
    assert (COLOURS[9], COLOURS[113], COLOURS[137], len(COLOURS)) == (
        "BLUE",
        "RED",
        "WHITE",
        141,
    )


def test_a_form_writes_its_variables(tmp_path):
    """Inputs write DEST inside MIN and MAX, buttons copy SOURCE, and the form
    goes on until a button closes it.
    """
    text = FORM + "$N=0\n@W\n$N=$N+1\nIF $N<3\nGOTO W\nEND_IF\n"
    reader, port, _ = answered(
        tmp_path,
        text,
        [Answer({"IN1": 50.0}, "B1"), Answer({"IN1": 4.0}), Answer(press="B2")],
    )
    values = reader.store.scope.values
    assert (values["P"], values["D"], values["N"]) == (3, 4, 3)
    assert "label L1: 103.2 (FORECOLOR RED)" in port.messages[0]
    assert port.messages[0].startswith("FORM Tool data (BACKCOLOR BLUE)")
    assert port.messages[-1] == "FORM Tool data closed"
    assert not reader.forms.shown
    assert "FORM input IN1: 50 is over MAX 10, taken is 10" in port.messages
    assert sum("taken is" in message for message in port.messages) == 1


def test_inputs_are_shown_with_their_decimals(tmp_path):
    """NDECIMAL."""
    text = (
        "LIB_ADDINPUT I1\n$V=3.14159\nLIB_INPUTSETVALUE I1 $V\n{}LIB_SHOWFORM\n"
    )
    for places, shown in ((None, "3.14159"), (2, "3.14"), (0, "3")):
        line = "" if places is None else f"LIB_INPUTPROP I1 NDECIMAL {places}\n"
        _, port, _ = answered(tmp_path, text.format(line), [Answer()])
        assert (
            f"input I1: {shown}"
            in port.messages[0]
            .replace(" (NDECIMAL", "\n(NDECIMAL")
            .splitlines()[1]
        )


def test_messages_answer_in_x13(tmp_path):
    """0 OK, 1 YES, 2 NO; in the order of the script."""
    text = (
        'LIB_MESSAGE "a\\Nb" "cap" 1 3\n$A=$_X13\nLIB_MESSAGE a,cap,1,0\n'
        "$B=$_X13\nLIB_MESSAGE a cap 0 1\n$C=$_X13\n"
    )
    reader, port, _ = answered(
        tmp_path,
        text,
        [Answer(press="NO"), Answer(press="yes"), Answer(press="OK")],
    )
    assert [reader.store.scope.values[name] for name in "ABC"] == [2, 1, 0]
    assert port.messages[0] == "LIB_MESSAGE cap: a\nb"


def test_without_answers_a_running_program_stops(tmp_path):
    """Nobody there: error 909152 with its place, no hanging."""
    path = tmp_path / "p.isons"
    path.write_text('G1X1\nLIB_MESSAGE "go on?" "cap" 1 3\n')
    program = Program(path, parse_config(CELL), "isons", LivePort(np.zeros(4)))
    with pytest.raises(CncError) as caught:
        list(iter(program.read, None))
    assert (caught.value.code, caught.value.place.line) == (909152, 2)


def test_checking_takes_dialogs_as_acknowledged(tmp_path):
    """Without a script ``check`` presses the button that closes the form."""
    out = run(tmp_path, FORM + "LIB_SHOWFORM\nG1X1\n")
    assert out.port.messages[1] == "FORM Tool data closed"
    assert len(out.moves) == 1


def test_an_input_has_no_caption(tmp_path):
    """What is wrong is told in a sentence."""
    with pytest.raises(CncError, match="an input has no property CLOSEFORM"):
        run(tmp_path, "LIB_ADDINPUT I1\nLIB_INPUTPROP I1 CLOSEFORM 1\n")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("LIB_MESSAGE a b 2 0\n", 909151),
        ("LIB_LABELPROP L1 WIDTH 3\n", 909150),
        ("LIB_ADDLABEL L1\nLIB_LABELPROP L1 CLOSEFORM 3\n", 909150),
        ("LIB_ADDLABEL L1\nLIB_LABELPROP L1 BACKCOLOR 141\n", 909151),
        ("LIB_ADDLABEL L1\nLIB_LABELPROP L1 DIMFONT 5\n", 909151),
        ("LIB_ADDLABEL L1\nLIB_ADDBUTTON L1\n", 909150),
        ("LIB_ADDLABEL L1\nLIB_LABELPRINT L1 G $A\n", 909151),
        ("LIB_ADDINPUT I1\nLIB_INPUTPROP I1 ALIGN 3\n", 909151),
        ("LIB_ADDINPUT I1\nLIB_INPUTPROP I1 DEST 3\n", 909151),
        (
            "LIB_ADDINPUT I1\nLIB_INPUTPROP I1 MIN 10\nLIB_INPUTPROP I1 MAX 5\nLIB_SHOWFORM\n",
            909151,
        ),
        ("LIB_FOO 3\n", 900002),
        ("LIB_ADDFORM X\n", 900002),
    ],
)
def test_wrong_dialogs(tmp_path, text, code):
    """Unknown objects and properties, values out of range."""
    with pytest.raises(CncError) as caught:
        run(tmp_path, text)
    assert (caught.value.code, caught.value.place.line) == (
        code,
        text.count("\n"),
    )


def test_scripts(tmp_path):
    """Buttons by name, or inputs and a button; anything else is refused."""
    path = tmp_path / "a.json"
    path.write_text(json.dumps(["YES", {"set": {"in1": 2}, "press": "B"}]))
    assert read_answers(path) == [
        Answer(press="YES"),
        Answer({"IN1": 2.0}, "B"),
    ]
    for value in ('"b"', "NaN", "-Infinity", "true", "1" + 400 * "0"):
        path.write_text(f'[{{"set": {{"a": {value}}}}}]')
        with pytest.raises(CncError):
            read_answers(path)
    for wrong in ("{", "{}", "[3]", '[{"what": 1}]'):
        path.write_text(wrong)
        with pytest.raises(CncError):
            read_answers(path)
