"""Structured Text that real tools accept; the oracle is blark, a parser of TwinCAT projects that nobody here wrote."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from hli import export, layout

# IEC 61131-3 edition 3, table 4 and the elementary types; OVERRIDE is left out: TwinCAT and CODESYS do not reserve it.
_WORDS = """
ABS ABSTRACT ACTION AND ARRAY ASIN ATAN BOOL BY BYTE CASE CHAR CLASS CONFIGURATION CONSTANT CONTINUE COS CTD CTU CTUD
DATE DINT DIV DO DT DWORD ELSE ELSIF END_ACTION END_CASE END_FOR END_FUNCTION END_IF END_STRUCT END_TYPE END_VAR EQ EXIT
EXP EXTENDS F_EDGE F_TRIG FALSE FINAL FOR FROM FUNCTION FUNCTION_BLOCK GE GT IF IMPLEMENTS INITIAL_STEP INT INTERFACE
INTERNAL INTERVAL LE LEFT LEN LIMIT LINT LN LOG LREAL LT LTIME LWORD MAX METHOD MID MIN MOD MOVE MUX NAMESPACE NE
NON_RETAIN NOT NULL OF ON OR OVERLAP PRIORITY PRIVATE PROGRAM PROTECTED PUBLIC R_EDGE R_TRIG READ_ONLY READ_WRITE REAL
REF REF_TO REPEAT REPLACE RESOURCE RETAIN RETURN RIGHT ROL ROR RS SEL SHL SHR SIN SINGLE SINT SQRT SR STEP STRING STRUCT
SUB SUPER TAN TASK THEN THIS TIME TIME_OF_DAY TO TOD TOF TON TP TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNTIL USING
USINT VAR VAR_GLOBAL VAR_INPUT WHILE WITH WORD WSTRING XOR POINTER
"""
RESERVED = frozenset(_WORDS.split())
IDENTIFIER = re.compile(r"^(?!.*__)[A-Za-z]\w*(?<!_)$")


def blark(path: Path) -> str:
    """What blark makes of a file; it prints errors to either stream and does not always tell by its status."""
    done = subprocess.run(
        [sys.executable, "-m", "blark", "parse", "-s", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "failed" not in done.stderr.lower(), done.stderr
    assert "error" not in done.stderr.lower(), done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def parsed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The whole text through the parser, once."""
    path = tmp_path_factory.mktemp("st") / "HLI.st"
    path.write_text(export.st_types())
    return blark(path)


def test_every_structure_is_understood_with_all_its_members(parsed: str) -> None:
    """Names and types in order, as the layout has them."""
    assert re.search(r"TYPE HLI_EXT_VAR :\s*ARRAY ?\[0\.\.5999\] OF UDINT", parsed)
    for cls in (c for c in export._st_structures() if c is not layout.HLI_EXT_VAR):
        block = re.search(rf"^\s*TYPE {cls.__name__} :\n\s*STRUCT\n(.*?)END_STRUCT", parsed, re.DOTALL | re.MULTILINE)
        assert block, cls.__name__
        members = re.findall(r"^\s*(\w+) : (.+);$", block[1], re.MULTILINE)
        wanted = [export._st_member(name, ctype).removesuffix(";").split(" : ") for name, ctype in cls._fields_]
        assert [list(m) for m in members] == wanted


def test_globals_are_understood(parsed: str) -> None:
    """Pointers with their types, constants with their values."""
    assert re.search(r"gpCh.*ARRAY ?\[0\.\.11\] OF POINTER TO HLI_CHANNEL", parsed)
    assert re.search(r"gpVEGlobal : POINTER TO HLI_EXT_VAR", parsed)
    assert re.search(r"name: HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX\n(?:.*\n){1,12}?\s*value: 127", parsed)


def test_the_oracle_can_fail(tmp_path: Path) -> None:
    """A structure that is not closed is refused."""
    path = tmp_path / "bad.st"
    path.write_text(export.st_types().replace("END_STRUCT", "END_STRUCTURE", 1))
    with pytest.raises(AssertionError):
        assert "HLI_CHANNEL" in blark(path)


def names() -> list[str]:
    found = [cls.__name__ for cls in export._st_structures()]
    found += [export.ST_RENAMED.get(n, n) for cls in export._st_structures() for n, _ in cls._fields_]
    return [*found, *export._st_constants()]


def test_no_name_is_reserved_or_malformed() -> None:
    """Case does not count; no double and no closing underscore (IEC 61131-3, 6.1.2)."""
    for name in names():
        assert name.upper() not in RESERVED, name
        assert IDENTIFIER.match(name), name
    assert len({n.upper() for n in export._st_constants()}) == len(export._st_constants())


def test_twincat_project_files(tmp_path: Path) -> None:
    """Well-formed XML, one object a file, stable and different Ids; blark reads them."""
    files = export.twincat_files()
    assert len(files) == len(export._st_structures()) + 2
    ids = set()
    for name, text in files.items():
        root = ET.fromstring(text)
        assert root.tag == "TcPlcObject"
        assert f"{root[0].get('Name')}.Tc{root[0].tag}" == name
        ids.add(root[0].get("Id"))
    assert len(ids) == len(files)
    assert files == export.twincat_files()
    for name, member in (("HLI_CHANNEL.TcDUT", "decoder_mc_control"), ("HLI_Global_Variables.TcGVL", "gpPform")):
        (tmp_path / name).write_text(files[name])
        assert member in blark(tmp_path / name)


def test_constants_agree_with_the_plc_side() -> None:
    """Mode and state numbers of the function blocks and of the exported constants are one."""
    from plc_client import Mode, ProcessState  # noqa: PLC0415

    for mode in Mode:
        assert export.ST_CONSTANTS[f"HLI_IMCM_{mode.name}_MODE"] == mode
    for state in list(ProcessState)[:6]:
        assert export.ST_CONSTANTS[f"HLI_IMCM_PROCESS_{state.name}"] == state
    assert layout.HLI_CLAH_LOG_ON == 3
