"""What stands around a run knows a cell with several channels, or refuses it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cnc_core import CncError, Recording
from cnc_core.pytest_plugin import PlcFactory
from plc_client import ContourLookahead, task
from support.command_line import Outcome

Cli = Callable[..., Outcome]
CELL = """
[channel.m_synch]
8 = "MVS_SVS"
[channels.mill.axes.X]
[channels.saw.axes.X]
"""


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    """A cell file and a program a channel."""
    found = [tmp_path / name for name in ("cell.toml", "mill.nc", "saw.nc")]
    texts = (CELL, "M8\nG1 X10 F6000\nM30\n", "G1 X20 F6000\nM8\nM30\n")
    for path, text in zip(found, texts, strict=True):
        path.write_text(text)
    return found


@pytest.mark.ci
def test_a_stepped_plc_has_all_channels(
    plc: PlcFactory, files: list[Path], tmp_path: Path
) -> None:
    """The fixture ``plc`` takes a program a channel and records them."""

    @task(interval=0.001)
    class Looks:
        def setup(self, hli):  # type: ignore[no-untyped-def]
            self.count = hli.gNrCh
            self.looks = [ContourLookahead(hli.gpCh[i]) for i in range(2)]

        def cyclic(self) -> None:
            for look in self.looks:
                look(start_position=0.0, length=1e6)

    cell, *programs = files
    kept = tmp_path / "run.parquet"
    runner = plc(Looks, programs, config=cell, record=kept, autostart=True)
    runner.run_until(lambda: all(len(b.blocks) for b in runner.task.looks))
    found = [look.blocks["length"][0] for look in runner.task.looks]
    assert (runner.task.count, found) == (2, [100_000.0, 200_000.0])
    runner.close()
    assert Recording(kept).channels == ("mill", "saw")
    with pytest.raises(CncError, match="3 programs"):
        plc(Looks, [*programs, programs[0]], config=cell)
    with pytest.raises(CncError, match="file not found"):
        plc(Looks, [tmp_path / "none.nc"], config=cell)


@pytest.mark.parametrize(
    "command",
    [
        ("fmu", "mill.nc", "-o", "cell.fmu"),
        ("lookahead", "mill.nc", "--index", "0"),
        ("sweep", "study.toml"),
    ],
)
def test_what_takes_one_channel_says_so(
    cli: Cli, files: list[Path], tmp_path: Path, command: tuple[str, ...]
) -> None:
    """The error names the channels, and nothing is started."""
    (tmp_path / "study.toml").write_text(
        'programs = ["mill.nc"]\ncells = ["cell.toml"]\n'
    )
    more = () if command[0] == "sweep" else ("--config", files[0])
    found = cli(*command, *more)
    assert found.status
    assert "channels (mill, saw)" in found.out + found.err


@pytest.mark.ci
def test_check_takes_the_programs_of_all_channels(
    cli: Cli, files: list[Path]
) -> None:
    """One call tells the errors of each, with the channel; those that the cell
    file names are checked, too.  With --channel it is one.
    """
    cell, mill, saw = files
    saw.write_text("G1 X20 F6000\n#NIX\nM30\n")
    found = cli("check", mill, saw, "--config", cell, "--json")
    assert found.status == 1
    first, second = found.json["channels"]
    assert (first["name"], first["errors"], second["name"]) == (
        "mill",
        [],
        "saw",
    )
    assert [one["line"] for one in second["errors"]] == [2]
    assert found.json["errors"] == second["errors"]
    assert found.json["blocks"] == first["blocks"] + second["blocks"]
    named = cell.read_text().replace(
        "[channels.saw", '[channels.saw]\nprogram = "saw.nc"\n[channels.saw'
    )
    cell.write_text(named)
    assert cli("check", mill, "--config", cell).status == 1
    assert cli("check", mill, "--config", cell, "--channel", "mill").status == 0
    many = cli("check", mill, saw, mill, "--config", cell)
    assert many.status == 1
    assert "3 programs" in many.err


ST = """PROGRAM MAIN
VAR
  clah : ContourLookahead;
  feed : FeedControl;
END_VAR
clah(channel := 1, start_position := 0.0, length := 1000000.0);
IF clah.done THEN feed(channel := 1, override := 50.0); END_IF
END_PROGRAM
"""


@pytest.mark.ci
def test_structured_text_takes_a_channel_by_its_number(
    cli: Cli, files: list[Path], tmp_path: Path
) -> None:
    """Its blocks ask and command that channel alone."""
    (tmp_path / "plc.st").write_text(ST)
    cell, mill, saw = files
    for path in (mill, saw):  # nobody acknowledges
        path.write_text(path.read_text().replace("M8\n", ""))
    found = cli(
        "run", mill, saw, "--config", cell, "--plc", tmp_path / "plc.st",
        "--record", tmp_path / "run.arrow", "--json",
    )  # fmt: skip
    first, second = found.json["channels"]
    assert first["requests"]["mode2"] == 0
    assert second["requests"]["mode2"] > 10
    cycles = Recording(tmp_path / "run.arrow").cycles
    assert cycles["mill.override"].min() == 100.0
    assert cycles["saw.override"].min() == 50.0
