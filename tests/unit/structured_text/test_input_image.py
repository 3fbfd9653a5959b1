"""What the CNC shows is latched once per scan, for programs in Structured Text, too."""

from __future__ import annotations

from pathlib import Path

from plc_client import connect
from plc_client.image import InputImage
from plc_client.mock import MockCnc, line
from plc_client.runner import PlcRunner
from plc_client.st import build
from plc_client.st.machine.loader import StProgram

LOGIC = """PROGRAM MAIN
VAR
  place, known, copied : LREAL;
  axis : DINT;
  p : POINTER TO HLI_BAHN_STATE;
  own : HLI_CONTOUR_LOOKAHEAD;
END_VAR
place := gpCh[0]^.bahn_state.dist_prog_start;
known := gpCh[0]^.contour_lookahead.state.max_dist_prog_start;
axis := gpAx[0]^.lr_state.current_position_acs_r;
p := ADR(gpCh[0]^.bahn_state);
copied := p^.dist_prog_start;
own.state.max_dist_prog_start := 3.0;
IF own.state.max_dist_prog_start <> 3.0 THEN known := -1.0; END_IF
END_PROGRAM
"""


def test_a_scan_sees_what_was_latched() -> None:
    """What the CNC shows behind the latch is the next scan's, by pointers, too;
    structures of the program itself are no part of it.
    """
    with MockCnc([line(30)]) as cnc, connect(cnc.name) as hli:
        cnc.run_to(20)
        image = InputImage(hli)
        program = StProgram(build({"logic.st": LOGIC}))
        program.connect(hli)
        program.start(0)
        main = program["MAIN"]
        latched = cnc.distance
        cnc.run_to(40)
        for shown in (latched, cnc.distance):
            program.run(program.entry("MAIN"), 0)
            assert main.place == main.copied == shown > 0.0
            assert main.known == 300_000.0
            assert main.axis == hli.gpAx[0].lr_state.current_position_acs_r
            image.latch()
        image.close()


def test_forced_values_of_the_state_are_what_the_program_reads(
    tmp_path: Path,
) -> None:
    """As in Python, until the force is taken back."""
    path = tmp_path / "logic.st"
    path.write_text(LOGIC)
    symbol = "gpCh[0]^.bahn_state.dist_prog_start"
    with PlcRunner.on_mock(path, [line(20)]) as plc:
        plc.force(symbol, 77.0)
        plc.step(3)
        assert plc["MAIN"].place == 77.0
        plc.unforce(symbol)
        plc.step(3)
        assert plc["MAIN"].place == 5000.0
