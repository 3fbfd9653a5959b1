"""Programs that a program starts in other channels: the Job Manager."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.channels import THREE, Channels

ORDER = '#MC_MovePath SYN [CH=2 JobID=633 FileName="job.nc" @PL1=4 @PL5=2.5]\n'
WAIT = "#WAIT MC_Status [JobID=633 MC_DONE MC_ABORTED MC_ERROR]\n"
MOVES = "G1 X[@PL1] F6000\nZ[@PL5]\nM30\n"


def job(folder: Path, text: str, name: str = "job.nc") -> None:
    (folder / name).write_text(text)


def said(cnc: Channels, index: int) -> list[str]:
    preparation = cnc.channels[index].preparation
    assert preparation is not None
    return preparation.port.messages


def error_of(cnc: Channels, index: int) -> tuple[int, str]:
    preparation = cnc.channels[index].preparation
    assert preparation is not None
    assert preparation.error is not None
    return preparation.error.code, preparation.error.text


def test_a_program_starts_another_and_waits_for_it(tmp_path: Path) -> None:
    """The manual's example: the values come along, the client goes on when the
    job has ended, and knows how.
    """
    job(tmp_path, MOVES)
    client = (
        f"G1 X1 F6000\n{ORDER}{WAIT}V.P.S = MCV_WAIT_STATUS [633]\n"
        '$IF V.P.S == MC_DONE\n#MSG ["done"]\n$ENDIF\nG1 X2\nM30\n'
    )
    with Channels(tmp_path, [client, None, None]) as cnc:
        cnc.until(lambda: cnc.positions(1)[0] > 0.0)
        assert cnc.positions(0) == [1.0, 0.0]  # SYN: behind the motion
        waits = cnc.channels[0].waits
        cnc.until(lambda: cnc.positions(1)[0] == 4.0)
        cnc.run(20)
        assert [one.what for one in waits.now()] == ["until job 633 has ended"]
        assert cnc.positions(0) == [1.0, 0.0]
        assert cnc.end() == ["completed", "completed", "unused"]
        assert said(cnc, 0) == ["done"]
        assert (cnc.positions(0)[0], cnc.positions(1)) == (2.0, [4.0, 2.5])


def test_jobs_of_one_channel_come_one_behind_the_other(tmp_path: Path) -> None:
    """Those of different channels go at once.  A job behind a program that runs
    there waits for its end.
    """
    job(tmp_path, "G91 G1 Y[@PL1] F6000\nM30\n", "y.nc")
    client = "".join(
        f'#MC_MovePath [CH=3, JobID={n}, FileName="y.nc" @PL1={n}]\n'
        for n in (1, 2, 3)
    )
    client += "#WAIT MC_Status [JobID=3]\n#WAIT MC_Status [JobID=1]\nG1 X1 F600\nM30\n"
    own = "G1 Y10 F6000\nM30\n"
    with Channels(tmp_path, [client, None, own]) as cnc:
        assert cnc.end() == ["completed", "unused", "completed"]
        assert cnc.positions(2) == [16.0]
        assert cnc.positions(0)[0] == 1.0


@pytest.mark.parametrize(
    ("text", "state"),
    [("G1 X1 F6000\nM30\n", "MC_DONE"), ("#NIX\nM30\n", "MC_ERROR")],
)
def test_how_a_job_has_ended_is_known(
    tmp_path: Path, text: str, state: str
) -> None:
    """Its error leaves the client alone."""
    job(tmp_path, text)
    order = '#MC_MovePath [CH=2 JobID=1 FileName="job.nc"]\n'
    client = (
        f"{order}#WAIT MC_Status [JobID=1]\n"
        f"$IF MCV_WAIT_STATUS[1] == {state}\nG1 X3 F6000\n$ENDIF\nM30\n"
    )
    with Channels(tmp_path, [client, None, None]) as cnc:
        assert cnc.end()[0] == "completed"
        assert cnc.positions(0)[0] == 3.0


def test_a_program_resets_another_channel(tmp_path: Path) -> None:
    """What is executed there is aborted; the job in the queue is done."""
    job(tmp_path, "G1 X1000 F600\nM30\n")
    client = (
        '#MC_MovePath [CH=2 JobID=1 FileName="job.nc"]\n'
        "#WAIT MC_Status [JobID=1 MC_ACTIVE]\nG4 X0.1\n"
        "#MCV_GrpResetForced SYN [CH=2 JobID=2]\n"
        "#WAIT MC_Status [JobID=1]\n"
        "$IF MCV_WAIT_STATUS[1] == MC_ABORTED\nG1 X3 F6000\n$ENDIF\nM30\n"
    )
    with Channels(tmp_path, [client, None, None]) as cnc:
        assert cnc.end()[:2] == ["completed", "aborted"]
        assert cnc.positions(0)[0] == 3.0
        assert 0.0 < cnc.positions(1)[0] < 5.0


@pytest.mark.parametrize(
    ("client", "code", "text"),
    [
        (ORDER + ORDER, 907057, "used already"),
        (WAIT, 907057, "has not ordered"),
        ("G1 X[MCV_WAIT_STATUS[1]]\n", 907057, "no #WAIT MC_Status"),
        (ORDER.replace("CH=2", "CH=1"), 250008, "itself"),
        (ORDER.replace("CH=2", "CH=4"), 250008, "channels 1 to 3"),
        (ORDER.replace("job.nc", "none.nc"), 901001, "none.nc not found"),
        (ORDER.replace("CH=2 ", ""), 900010, "without CH"),
        (ORDER + WAIT.replace("MC_DONE", ""), 907057, "ended as MC_DONE"),
        ("G1 X[@PL1] F600\n", 907010, "@PL1 is not given"),
    ],
)
def test_wrong_orders_are_told(
    tmp_path: Path, client: str, code: int, text: str
) -> None:
    """With the place; nothing else happens."""
    job(tmp_path, MOVES)
    with Channels(tmp_path, [f"{client}M30\n", None, None]) as cnc:
        assert cnc.end()[0] == "error"
        found = error_of(cnc, 0)
        assert found[0] == code
        assert text in found[1]


def test_a_job_orders_no_jobs(tmp_path: Path) -> None:
    """280611, as the manual has it for agents."""
    job(tmp_path, ORDER.replace("CH=2", "CH=3") + "M30\n")
    with Channels(tmp_path, [f"{ORDER}{WAIT}M30\n", None, None]) as cnc:
        assert cnc.end() == ["completed", "error", "unused"]
        assert error_of(cnc, 1)[0] == 280611


def test_a_client_and_its_job_that_wait_for_each_other(tmp_path: Path) -> None:
    """A deadlock of a job and a signal is told, not waited for."""
    job(tmp_path, "#WAIT [ID=1 CH=1]\nM30\n")
    client = f"{ORDER}{WAIT}#SIGNAL [ID=1 CH=2]\nM30\n"
    with Channels(tmp_path, [client, None, None]) as cnc:
        assert cnc.end() == ["error", "error", "unused"]
        code, text = error_of(cnc, 0)
        assert code == 907056
        assert "channel mill waits for job 633 in channel loader" in text
        assert "channel loader waits for signal 1 of channel mill" in text


def test_a_signal_may_come_from_a_job(tmp_path: Path) -> None:
    """A channel without a program is no deadlock while another could start one
    there.
    """
    job(tmp_path, "G1 X1 F6000\n#SIGNAL SYN [ID=1 CH=3]\nM30\n")
    client = f"G1 X5 F6000\n{ORDER}M30\n"
    waiter = "#WAIT [ID=1 CH=2]\nG1 Y1 F6000\nM30\n"
    with Channels(tmp_path, [client, None, waiter], THREE) as cnc:
        assert cnc.end() == ["completed"] * 3
        assert cnc.positions(2) == [1.0]
