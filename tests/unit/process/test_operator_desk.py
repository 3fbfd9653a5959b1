"""The operator of a CNC in another process."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from cnc_core.frontend.operator import Answer, Operator, Question
from cnc_core.process.operator_desk import KEPT, OperatorDesk
from hli import HliNotFound
from hli.orders import CNC, send
from support.fake_cnc import unique_name

QUESTION = Question("Tool", "which?", ("OK", "NO"), {"R": 1.0})


def asked(desk: OperatorDesk) -> tuple[threading.Thread, list[Any]]:
    """A program that waits for its dialog."""
    found: list[Any] = []
    operator = Operator(desk=desk)
    thread = threading.Thread(
        target=lambda: found.append(operator.ask(QUESTION))
    )
    thread.start()
    return thread, found


def look(name: str, **order: Any) -> dict[str, Any]:
    return send(name, {"do": "look", **order}, side=CNC)


def test_a_dialog_is_answered_by_another_process() -> None:
    """It is shown with its number; wrong answers are refused with the reason,
    the right one goes on, and a second one finds no dialog.
    """
    name = unique_name()
    desk = OperatorDesk(lambda: {"line": 3}, attended=True)
    desk.open(name)
    try:
        thread, found = asked(desk)
        while not (dialog := look(name)["dialog"]):
            pass
        number = dialog["number"]
        assert (dialog["title"], dialog["inputs"]) == ("Tool", {"R": 1.0})
        wrong: list[tuple[dict[str, Any], str]] = [
            ({"press": "YES"}, "no button 'YES'; it has: OK, NO"),
            ({"press": "OK", "set": {"Q": 1}}, "no input 'Q'"),
            ({"press": "OK", "set": {"R": "1"}}, "finite number"),
            ({"press": "OK", "set": {"R": float("inf")}}, "finite number"),
            ({"press": "OK", "set": {"R": True}}, "finite number"),
            ({"press": "OK", "set": [1]}, "numbers by name"),
            ({"press": "OK", "number": number + 1}, "this dialog is closed"),
        ]
        for order, problem in wrong:
            with pytest.raises(ValueError, match=problem):
                answer(name, **{"number": number, **order})
        answer(name, number=number, press="OK", set={"R": 2})
        thread.join()
        assert found == [Answer({"R": 2.0}, "OK")]
        assert look(name)["dialog"] is None
        with pytest.raises(ValueError, match="no dialog is open"):
            answer(name, number=number, press="OK")
    finally:
        desk.close()
    with pytest.raises(HliNotFound, match="no CNC process"):
        look(name)


def answer(name: str, **order: Any) -> None:
    send(name, {"do": "answer", **order}, side=CNC)


def test_nobody_there_answers_nothing() -> None:
    """Without a page that looks the program does not wait."""
    desk = OperatorDesk(dict)
    assert not desk.attended
    assert Operator(desk=desk).ask(QUESTION) is None
    desk._obey({"do": "look"})
    assert not desk.attended
    desk._obey({"do": "look", "attended": True})
    assert desk.attended


def test_a_command_gets_cycles_while_a_dialog_is_open() -> None:
    """None without a dialog; with one as many as there are, until the command
    is there.
    """
    desk = OperatorDesk(dict, attended=True)
    desk._obey({"do": "cycles"})
    with desk.shown(QUESTION):
        assert not desk.takes_cycle()
        given = desk._obey({"do": "cycles"})["cycles"]
        assert sum(desk.takes_cycle() for _ in range(2 * given)) == given
        desk._obey({"do": "cycles"})
        desk.no_more_cycles()
        assert not desk.takes_cycle()


def test_a_dialog_of_another_channel_leaves_the_one_below() -> None:
    """Its answer is its own; behind it the first one is open again."""
    desk = OperatorDesk(dict, attended=True)
    with desk.shown(QUESTION):
        first = desk._obey({"do": "look"})["dialog"]["number"]
        with desk.shown(Question("Other", "?")):
            second = desk._obey({"do": "look"})["dialog"]["number"]
            desk._obey({"do": "answer", "number": second, "press": ""})
            assert desk.answered(0.0) == Answer({}, "")
        assert desk.answered(0.0) is None
        assert desk._obey({"do": "look"})["dialog"]["number"] == first


def test_an_end_of_the_run_ends_the_wait() -> None:
    """A signal: no answer."""
    desk = OperatorDesk(dict, attended=True)
    operator = Operator(desk=desk, interrupted=lambda: True)
    assert operator.ask(QUESTION) is None
    assert desk._obey({"do": "look"})["dialog"] is None


def test_the_last_texts_are_kept() -> None:
    """As many as there is room for; facts that fail are none."""
    desk = OperatorDesk(lambda: {}["x"] if desk else {})
    for k in range(KEPT + 5):
        desk.say("message", f"text {k}")
    said = desk._look({"since": 3})["said"]
    assert len(said) == KEPT
    assert said[-1][3] == f"text {KEPT + 4}"
    with pytest.raises(ValueError, match="look, answer and cycles"):
        desk._obey({"do": "force"})
