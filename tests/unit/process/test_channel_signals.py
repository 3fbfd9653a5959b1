"""#SIGNAL and #WAIT between the channels of a cell."""

from __future__ import annotations

from pathlib import Path

import pytest

from hli import layout
from support.channels import AUTOMATIC, THREE, Channels


def ends_at(cnc: Channels, index: int) -> int:
    """The cycle in which a channel's program has ended."""
    cnc.until(lambda: bool(cnc.channels[index].ended_at), 1)
    return cnc.cycle


def test_a_wait_lasts_until_the_signal(tmp_path: Path) -> None:
    """#WAIT SYN stands where it is written until the other channel's path has
    passed #SIGNAL SYN; the sender does not stop for it.
    """
    sender = "N10 G1 X20 F6000\nN20 #SIGNAL SYN [ID=7 CH=2]\nN30 X40\nN40 M30\n"
    waiter = "N10 G1 X1 F6000\nN20 #WAIT SYN [ID=7 CH=1]\nN30 X3\nN40 M30\n"
    plain = "N10 G1 X20 F6000\nN30 X40\nN40 M30\n"
    with Channels(tmp_path, [plain, None, None]) as cnc:
        alone = ends_at(cnc, 0)
    with Channels(tmp_path, [sender, waiter, None]) as cnc:
        cnc.run(150)
        assert cnc.positions(1) == [1.0, 0.0]
        assert cnc.positions(0)[0] < 20.0
        waits = cnc.channels[1].waits.now()
        assert [w.what for w in waits] == ["signal 7 of channel mill"]
        assert waits[0].line == 2
        cnc.until(lambda: cnc.positions(1)[0] > 1.0)
        assert cnc.positions(0)[0] == pytest.approx(20.0, abs=0.5)
        assert ends_at(cnc, 0) == alone
        assert cnc.end() == ["completed", "completed", "unused"]


def test_signals_are_there_for_a_later_wait(tmp_path: Path) -> None:
    """A signal that was sent first is kept; each wait uses one up."""
    sender = "N10 #SIGNAL [ID=1 CH=2]\nN20 #SIGNAL [ID1 CH2]\nN30 M30\n"
    waiter = (
        "N5 G4 X0.02\nN10 #WAIT [ID=1 CH=1]\nN20 #WAIT [ID1 CH1]\n"
        "N25 G1 X2 F6000\nN30 #WAIT [ID=1 CH=1]\nN40 G1 X9\nN50 M30\n"
    )
    with Channels(tmp_path, [sender, waiter, None]) as cnc:
        cnc.plc = True
        cnc.run(400)
        assert cnc.positions(1) == [2.0, 0.0]
        assert not cnc.channels[1].ended_at


def test_a_broadcast_stays_until_it_is_removed(tmp_path: Path) -> None:
    """Without a receiver any number of waits of any channel pass; COUNT makes
    it finite, #SIGNAL REMOVE ends it.
    """
    sender = (
        "N10 #SIGNAL [ID=5]\nN15 #SIGNAL [ID=6 COUNT=1]\nN20 G4 X0.1\n"
        "N25 #FLUSH WAIT\nN30 #SIGNAL REMOVE [ID=5]\nN40 M30\n"
    )
    waiter = (
        "N10 #WAIT [ID=5]\nN20 #WAIT [ID=5]\nN30 #WAIT [ID=6]\nN40 G1 X1 F6000\n"
        "N45 G4 X0.3\nN46 #FLUSH WAIT\nN50 #WAIT [ID=5]\nN60 X2\nN70 M30\n"
    )
    second = "N10 #WAIT [ID=5]\nN20 G1 Y1 F6000\nN30 M30\n"
    with Channels(tmp_path, [sender, waiter, second]) as cnc:
        cnc.plc = True
        cnc.run(700)
        assert cnc.positions(1) == [1.0, 0.0]
        assert cnc.positions(2) == [1.0]
        assert [c.end for c in cnc.channels] == [
            "completed",
            "aborted",
            "completed",
        ]


def test_values_come_along(tmp_path: Path) -> None:
    """P of #SIGNAL goes into the variables of #WAIT, of several senders too."""
    first = "N10 #SIGNAL [ID=3 P[0]=4.5 CH=3]\nN20 M30\n"
    second = "N10 #SIGNAL [ID=3 P[2]=1.25 CH=3]\nN20 M30\n"
    waiter = (
        "N5 V.P.A = 0\nN6 V.P.B = 0\n"
        "N10 #WAIT [ID=3 P[0]=V.P.A P[2]=V.P.B CH=1 CH=2]\n"
        "N20 G1 Y[V.P.A + V.P.B] F6000\nN30 M30\n"
    )
    with Channels(tmp_path, [first, second, waiter]) as cnc:
        assert cnc.end() == ["completed"] * 3
        assert cnc.positions(2) == [5.75]


@pytest.mark.parametrize(
    ("sent", "awaited", "code", "said"),
    [
        ("P[0]=1", "P[1]=V.P.A", 21549, "no value P[1] came"),
        ("", "P[0]=V.P.A", 21549, "no value P[0] came"),
        ("CH=4", "", 250008, "channels 1 to 3 (mill, loader, saw)"),
    ],
)
def test_what_does_not_fit_is_told(
    tmp_path: Path, sent: str, awaited: str, code: int, said: str
) -> None:
    """A missing value and a channel that the cell does not have are errors."""
    sender = f"N10 #SIGNAL [ID=1 CH=2 {sent}]\nN20 M30\n"
    waiter = f"N5 V.P.A = 0\nN10 #WAIT [ID=1 CH=1 {awaited}]\nN20 M30\n"
    with Channels(tmp_path, [sender, waiter, None]) as cnc:
        cnc.end()
        errors = [
            error
            for channel in cnc.channels
            for error in (channel.preparation and [channel.preparation.error])
            or ()
            if error
        ]
        assert code in [error.code for error in errors]
        assert any(said in error.text for error in errors)


def test_a_deadlock_is_told(tmp_path: Path) -> None:
    """Channels that wait for each other end with an error that names who waits
    for what, where; a channel that has nothing to do with it goes on.
    """
    first = "N10 G1 X1 F6000\nN20 #WAIT SYN [ID=1 CH=2]\nN30 #SIGNAL [ID=2 CH=2]\nN40 M30\n"
    second = "N10 #WAIT [ID=2 CH=1]\nN20 #SIGNAL [ID=1 CH=1]\nN30 M30\n"
    third = "N10 G1 Y3 F600\nN20 M30\n"
    with Channels(tmp_path, [first, second, third]) as cnc:
        cnc.plc = True
        assert cnc.end() == ["error", "error", "completed"]
        for index in (0, 1):
            preparation = cnc.channels[index].preparation
            assert preparation is not None
            error = preparation.error
            assert error is not None
            assert error.code == 907056
            assert (
                "channel mill waits for signal 1 of channel loader"
                in error.text
            )
            assert (
                "channel loader waits for signal 2 of channel mill"
                in error.text
            )
            assert error.place.line == (2, 1)[index]


def test_what_may_still_come_is_no_deadlock(tmp_path: Path) -> None:
    """A signal that lies ahead on the path, or a PLC that could start a program
    in an idle channel, keeps a wait alive; nobody left to send it ends it.
    """
    own = (
        "N10 G1 X5 F6000\nN20 #SIGNAL SYN [ID=8 CH=1]\nN30 X6\n"
        "N40 #WAIT [ID=8 CH=1]\nN50 X7\nN60 M30\n"
    )
    idle = "N10 #WAIT [ID=9 CH=3]\nN20 M30\n"
    with Channels(tmp_path, [own, idle, None]) as cnc:
        cnc.plc = True
        cnc.until(lambda: bool(cnc.channels[0].ended_at), 10)
        assert cnc.channels[0].end == "completed"
        cnc.run(50)
        assert not cnc.channels[1].ended_at
        cnc.plc = False
        assert cnc.end() == ["completed", "error", "unused"]


def test_a_flying_wait_does_not_stop(tmp_path: Path) -> None:
    """AHEAD looks where the block is prepared: if the signal is there already,
    the path goes on as if nothing stood there.
    """
    sender = "N10 #SIGNAL [ID=1 CH=2]\nN20 M30\n"
    text = "N10 G1 X20 F6000\n{}N30 X40\nN40 M30\n"
    ends = []
    for wait in ("", "N20 #WAIT SYN [ID=1 CH=1 AHEAD]\n"):
        with Channels(tmp_path, [sender, text.format(wait), None]) as cnc:
            ends.append(ends_at(cnc, 1))
    assert ends[0] == ends[1]


def test_a_key_takes_a_parameter_without_a_space(tmp_path: Path) -> None:
    """The manual's first scenario: ``[IDP100 P[0]= V.P.SYNC CH3]``."""
    sender = (
        "V.P.SYNC = 1000\nP100 = 814\n"
        "#SIGNAL [IDP100 P[0]= V.P.SYNC CH3]\nM30\n"
    )
    waiter = (
        "#WAIT [ID814 P[0]= V.P.SIGNAL CH1]\nG1 Y[V.P.SIGNAL/100] F60000\nM30\n"
    )
    with Channels(tmp_path, [sender, None, waiter]) as cnc:
        assert cnc.end() == ["completed", "unused", "completed"]
        assert cnc.positions(2) == [10.0]


@pytest.mark.parametrize(
    ("removal", "left"),
    [
        ("[ID=1 CH=2]", [1, 2, 2, 3]),  # one of several goes, the oldest
        ("[IDMIN=1 IDMAX=2 CH=2]", [3]),
        ("[IDMIN=2 CH2]", [1, 1, 2, 3]),
        ("SYN [IDMIN=1 IDMAX=9 CH=2]", []),
        ("[IDMIN=1 IDMAX=9]", [1, 1, 2, 2, 3]),  # broadcasts alone
        ("[IDMIN=1 IDMAX=9 CH=3]", [1, 1, 2, 2, 3]),
    ],
)
def test_removal_of_one_signal_and_of_a_range(
    tmp_path: Path, removal: str, left: list[int]
) -> None:
    """What is left is read without a wait until nothing more is there."""
    sent = "".join(f"#SIGNAL [ID={n} CH=2]\n" for n in (1, 1, 2, 2, 3))
    sender = f"{sent}#SIGNAL REMOVE {removal}\nG1 X1 F600\n#SIGNAL SYN [ID=9 CH=2]\nM30\n"
    reads = "".join(
        f"#SIGNAL READ [ID={n} CH=1]\n"
        f'$IF V.G.SIGNAL_READ == TRUE\n#MSG ["{n}"]\n$ENDIF\n'
        for n in (1, 1, 2, 2, 3, 3)
    )
    waiter = f"G1 X5 F600\n#WAIT SYN [ID=9 CH=1]\n{reads}M30\n"
    if "SYN" in removal:
        waiter = waiter.replace("#WAIT SYN [ID=9 CH=1]\n", "#FLUSH WAIT\n")
    with Channels(tmp_path, [sender, waiter, None]) as cnc:
        assert cnc.end() == ["completed", "completed", "unused"]
        preparation = cnc.channels[1].preparation
        assert preparation is not None
        assert preparation.port.messages == [str(n) for n in left]


def test_a_program_asks_for_a_signal_in_a_loop(tmp_path: Path) -> None:
    """#SIGNAL READ does not wait: the program turns to something else, and the
    values come with the signal.  An early signal is used up by one read.
    """
    sender = "G1 X10 F6000\n#SIGNAL SYN [ID=4 CH=2 P[1]=2.5]\nM30\n"
    reader = (
        "V.P.N = 0\nV.P.V = 0\n#SIGNAL READ [ID=4 CH=1 P[1]=V.P.V]\n"
        "$WHILE V.G.SIGNAL_READ == FALSE\nV.P.N = V.P.N + 1\n"
        "#SIGNAL READ [ID=4 CH=1 P[1]=V.P.V]\n$ENDWHILE\n"
        "#SIGNAL READ [ID=4 CH=1]\n$IF V.G.SIGNAL_READ == FALSE\n"
        "G1 X[V.P.V] F60000\n$ENDIF\n"
        "$IF V.P.N > 50\nG1 Z1\n$ENDIF\nM30\n"
    )
    with Channels(tmp_path, [sender, reader, None]) as cnc:
        assert cnc.end() == ["completed", "completed", "unused"]
        assert cnc.positions(1) == [2.5, 1.0]


def test_a_program_waits_for_a_condition(tmp_path: Path) -> None:
    """#WAIT FOR lasts until the expression is above 0.5; another channel may
    make it so.  What waits is told.
    """
    first = "G1 X20 F6000\n#FLUSH WAIT\nV.E.PART = 5\nM30\n"
    second = "#WAIT FOR V.E.PART == 5\nG1 X1 F6000\nM30\n"
    cell = f'{THREE}[external.PART]\ntype = "UNS32"\nscope = "global"\n'
    with Channels(tmp_path, [first, second, None], cell) as cnc:
        cnc.run(100)
        waits = cnc.channels[1].waits.now()
        assert [one.what for one in waits] == ["until V.E.PART == 5"]
        cnc.until(lambda: cnc.positions(0)[0] > 19.99)
        assert cnc.positions(1) == [0.0, 0.0]
        assert cnc.end() == ["completed", "completed", "unused"]
        assert cnc.positions(1) == [1.0, 0.0]


def test_a_program_knows_its_channel(tmp_path: Path) -> None:
    """V.G.CNC_CHANNEL counts from 1 on."""
    text = "G1 {}[V.G.CNC_CHANNEL] F6000\nM30\n"
    texts = [text.format(axis) for axis in "XXY"]
    with Channels(tmp_path, texts) as cnc:
        assert cnc.end() == ["completed"] * 3
        assert [cnc.positions(i)[0] for i in range(3)] == [1.0, 2.0, 3.0]


def test_a_reset_takes_signals_to_the_channel(tmp_path: Path) -> None:
    """The manual, "Reset handling": signals to the channel that is reset go,
    broadcasts and signals to others stay.
    """
    sender = "#SIGNAL [ID=1 CH=2]\n#SIGNAL [ID=2]\n#SIGNAL [ID=3 CH=3]\nM30\n"
    text = "".join(
        f"#SIGNAL READ [ID={n} {who}]\n"
        f'$IF V.G.SIGNAL_READ == TRUE\n#MSG ["{n}"]\n$ENDIF\n'
        for n, who in ((1, "CH=1"), (2, ""), (3, "CH=1"))
    )
    reader = f"#FLUSH WAIT\n{text}M30\n"
    with Channels(tmp_path, [sender, reader, reader], start=False) as cnc:
        cnc.channels[0].start()
        cnc.end()
        cnc.command(1, AUTOMATIC, layout.HLI_IMCM_PROCESS_RESETTING)
        cnc.run(5)
        file = cnc.channels[1].file
        assert file is not None
        cnc.channels[1].modes.select(file)
        cnc.channels[1].start()
        cnc.channels[2].start()
        cnc.end()
        found = [cnc.channels[i].preparation for i in (1, 2)]
        assert [one and one.port.messages for one in found] == [
            ["2"],
            ["2", "3"],
        ]


@pytest.mark.parametrize(
    ("block", "code"),
    [
        ("#WAIT SYN [ID=1 CH=2 P[0]=V.P.A]", 21344),
        ("#SIGNAL READ SYN [ID=1 CH=2]", 21344),
        ("#SIGNAL [ID=-1 CH=2]", 20995),
        ("#SIGNAL [ID=1 CH=0]", 20996),
        ("#WAIT [ID=1 CH=13]", 250008),
        ("#SIGNAL [IDMIN=1 CH=2]", 900010),
    ],
)
def test_wrong_commands_have_the_vendors_numbers(
    tmp_path: Path, block: str, code: int
) -> None:
    """As the diagnosis manual lists them, where it does."""
    with Channels(tmp_path, [f"V.P.A = 0\n{block}\nM30\n", None, None]) as cnc:
        cnc.plc = True
        assert cnc.end()[0] == "error"
        preparation = cnc.channels[0].preparation
        assert preparation is not None
        assert preparation.error is not None
        assert (preparation.error.code, preparation.error.place.line) == (
            code,
            2,
        )


def test_a_channel_that_waits_can_be_reset(tmp_path: Path) -> None:
    """The PLC aborts it; the wait is forgotten and the other channel goes on."""
    waiter = "N10 #WAIT [ID=1 CH=2]\nN20 M30\n"
    other = "N10 G1 X30 F6000\nN20 M30\n"
    with Channels(tmp_path, [waiter, other, None]) as cnc:
        cnc.run(20)
        cnc.channels[0].modes.abort()
        assert cnc.end() == ["aborted", "completed", "unused"]
