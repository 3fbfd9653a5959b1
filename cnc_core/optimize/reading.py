"""Setup and profiles of the program that the Path Optimizer reads."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..blocks.profile_columns import BLEND, PASS, STOP, ProfileSpec
from ..config import CellConfig
from ..errors import CncError, Place
from ..frontend.osai.codes import CODES
from ..frontend.osai.front_end import OsaiFrontEnd
from ..frontend.osai.setup import Records, SetupFile
from ..frontend.osai.spec import in_mm
from ..frontend.port import OfflinePort, Wait
from ..geometry.profiles.points import Points
from .columns import OutputColumns
from .program_text import BEGIN, CALL, middle
from .progress import Tick
from .types import Tolerances

MODES = {"G63": BLEND, "G66": STOP, "G67": PASS}
EDGE_CODES = {"linear": "C0", "other": "C0X", "versor": "C0V"}
READ_ROWS = 4096


@dataclass
class Profile:
    """A profile of the program, with its points."""

    spec: ProfileSpec
    points: Points


@dataclass(frozen=True)
class Settings:
    """What the setup asks for.

    ``codes``: how edges are passed, by kind of edge.  ``own_length``: the
    setup gives the tool a length of its own (TOL).
    """

    records: Records
    tolerances: Tolerances
    codes: dict[str, int]
    own_length: bool


class ProgramReader:
    """Reads setup and program; CncError for what is wrong with either."""

    def __init__(self, source: Path, setup: Path, cell: CellConfig) -> None:
        self.source, self.setup, self.cell = source, setup, cell

    def first_look(self) -> None:
        """What makes no sense to read a program with."""
        setup = SetupFile(self.setup)
        if setup.errors:
            raise setup.errors[0]
        records, _ = setup.resolve(lambda letter, number: 0.0)
        if "SMT" not in {line.code for line in setup.lines}:
            raise records.missing(
                "the setup lacks SMT: the tolerances of the Path Optimizer"
            )
        if (
            "PNT" in records.general
            and records.general["PNT"].word("Format") != "PNT"
        ):
            raise records.general["PNT"].fail(
                909205, "PNT: the Path Optimizer takes points", "Format"
            )

    def profiles(self, lines: list[str], tick: Tick) -> list[Profile]:
        """Every profile of the program; a program without G61 is one."""
        # the reader knows of calls that are left
        if any(BEGIN.match(line) or CALL.match(line) for line in lines):
            return self._read(self.source, 0, tick)
        first, last = middle(lines)
        if first is None:
            raise CncError(
                909225,
                "the program has no point",
                Place(str(self.source), 1, 1),
            )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.source.name
            text = [
                *lines[:first],
                "G61",
                *lines[first:last],
                "G60",
                *lines[last:],
            ]
            path.write_text("\n".join(text) + "\n", encoding="utf-8")
            return self._read(path, first, tick)

    def _read(self, path: Path, inserted: int, tick: Tick) -> list[Profile]:
        machine = self.cell.program_machine()
        reader = OsaiFrontEnd(
            path, machine, OfflinePort(machine.start), setup=self.setup
        )
        self._variables = reader.variables
        size = max(path.stat().st_size, 1)
        found: list[tuple[ProfileSpec, list[Points]]] = []
        try:
            while (item := reader.read(READ_ROWS)) is not None:
                if isinstance(item, Wait) or item.profile is None:
                    continue
                chunk = item.profile
                last = int(chunk.number[-1]) if len(chunk.number) else 0
                tick(reader.bytes_read / size, last)
                if not found or found[-1][0] is not chunk.spec:
                    found.append((chunk.spec, []))
                found[-1][1].append(Points.of(chunk))
        except CncError as error:
            if path != self.source and error.place.file == str(path):
                error.place.file = str(self.source)
                error.place.line -= error.place.line > inserted
            raise
        finally:
            reader.close()
        return [Profile(spec, _joined(parts)) for spec, parts in found]

    def settings(self, profiles: list[Profile]) -> Settings:
        """The setup, once the program has been read: it knows its variables."""
        records = self._records()
        self._check_origin(records, profiles)
        codes = {
            kind: MODES[records.general["SMT"].word(name)]
            for kind, name in EDGE_CODES.items()
        }
        own_length = records.get("TOL").maybe("Len") is not None
        tolerances = _tolerances(in_mm(records, self.cell.program_machine()))
        return Settings(records, tolerances, codes, own_length)

    def _check_origin(self, records: Records, profiles: list[Profile]) -> None:
        """AXI points tell of the tip only with the tool length they were made
        for.
        """
        names = [field.name for field in CODES["TOL"]]
        written = [
            text
            for line in SetupFile(self.setup).lines
            if line.code == "TOL"
            for name, (text, _) in zip(names, line.fields, strict=False)
            if name == "OriginLen"
        ]
        for profile in profiles:
            spec = profile.spec
            known = any(written) or spec.tool.length == 0.0
            if OutputColumns.to_tip(spec) and not known:
                raise records.get("TOL").fail(
                    909204,
                    "TOL, OriginLen: AXI points become CLP with the tool length"
                    " that they were made for; it is empty, and the tool's"
                    f" length is {spec.tool.length:g} mm",
                    "OriginLen",
                )

    def _records(self) -> Records:
        """The setup with the program's variables."""
        records, errors = SetupFile(self.setup).resolve(self._variables)
        if errors:
            raise errors[0]
        smt, sms = records.general["SMT"], records.get("SMS")
        if sms.word("C1") == "ENA":
            raise sms.fail(
                900003,
                "SMS, C1: smoothing at C1-continuous points is not supported",
                "C1",
            )
        if sms.word("Progr") == "DIS":
            raise sms.fail(
                900003,
                "SMS, Progr: the debug output in place of a program is not supported",
                "Progr",
            )
        for name in ("Toll", "TollX", "TollV"):
            if name == "Toll" and not smt.number(name) > 0.0:
                raise smt.fail(
                    909205, "SMT, Toll: the tolerance must be positive", name
                )
        return records


def _tolerances(records: Records) -> Tolerances:
    smt, sms = records.general["SMT"], records.get("SMS")
    longest = sms.maybe("Len")
    return Tolerances(
        linear=smt.number("Toll"),
        other=smt.number("TollX") or smt.number("Toll"),
        versor=smt.number("TollV") or 0.1 * smt.number("Toll"),
        split=sms.number("Split"),
        split_other=sms.number("SplitX"),
        split_versor=sms.number("SplitV"),
        reach=smt.number("Racc"),
        reach_other=smt.number("RaccX"),
        reach_versor=smt.number("RaccV"),
        condition=int(sms.number("Cond")),
        condition_other=int(sms.number("CondX")),
        condition_versor=int(sms.number("CondV")),
        longest=0.0 if longest is None else longest,
        group=int(sms.number("Pnt")),
    )


def _joined(parts: list[Points]) -> Points:
    names = ("values", "feed", "after", "rapid", "line", "number")
    return Points(
        *(np.concatenate([getattr(p, name) for p in parts]) for name in names)
    )
