"""Structured Text that real tools accept; the oracle is blark, a parser of
TwinCAT projects that nobody here wrote.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest

from hli import export, layout

# IEC 61131-3 edition 3, table 4 and the elementary types; OVERRIDE is left out:
# TwinCAT and CODESYS do not reserve it.
_WORDS = """
ABS ABSTRACT ACTION AND ARRAY ASIN ATAN BOOL BY BYTE CASE CHAR CLASS CONFIGURATION
CONSTANT CONTINUE COS CTD CTU CTUD DATE DINT DIV DO DT DWORD ELSE ELSIF END_ACTION
END_CASE END_FOR END_FUNCTION END_IF END_STRUCT END_TYPE END_VAR EQ EXIT EXP EXTENDS
F_EDGE F_TRIG FALSE FINAL FOR FROM FUNCTION FUNCTION_BLOCK GE GT IF IMPLEMENTS
INITIAL_STEP INT INTERFACE INTERNAL INTERVAL LE LEFT LEN LIMIT LINT LN LOG LREAL LT
LTIME LWORD MAX METHOD MID MIN MOD MOVE MUX NAMESPACE NE NON_RETAIN NOT NULL OF ON OR
OVERLAP PRIORITY PRIVATE PROGRAM PROTECTED PUBLIC R_EDGE R_TRIG READ_ONLY READ_WRITE
REAL REF REF_TO REPEAT REPLACE RESOURCE RETAIN RETURN RIGHT ROL ROR RS SEL SHL SHR SIN
SINGLE SINT SQRT SR STEP STRING STRUCT SUB SUPER TAN TASK THEN THIS TIME TIME_OF_DAY TO
TOD TOF TON TP TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNTIL USING USINT VAR
VAR_GLOBAL VAR_INPUT WHILE WITH WORD WSTRING XOR POINTER
"""
RESERVED = frozenset(_WORDS.split())
IDENTIFIER = re.compile(r"^(?!.*__)[A-Za-z]\w*(?<!_)$")


SCRIPT = """
import sys, blark.main
for name in sys.argv[1:]:
    print("=== " + name)
    sys.argv = ["blark", "parse", "-s", name]
    try:
        blark.main.main()
    except Exception as error:
        print("REFUSED", error)
"""
TWINCAT = (
    "HLI_CHANNEL.TcDUT",
    "HLI_Global_Variables.TcGVL",
    "HLI_Global_Constants.TcGVL",
)


@pytest.fixture(scope="module")
def blark(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What blark makes of the text, of three TwinCAT files and of a broken
    text; one process, its start is slow.

    It stands under another licence than the project: used where it is
    installed, required nowhere.
    """
    if importlib.util.find_spec("blark") is None:
        pytest.skip("blark is not installed")
    folder = tmp_path_factory.mktemp("st")
    files = {
        "HLI.st": export.st_types(),
        "bad.st": export.st_types().replace("END_STRUCT", "END_STRUCTURE", 1),
    }
    files |= {name: export.twincat_files()[name] for name in TWINCAT}
    for name, text in files.items():
        (folder / name).write_text(text)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *files],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(part.split("\n", 1) for part in done.stdout.split("=== ")[1:])


@pytest.fixture
def parsed(blark: dict[str, str]) -> str:
    """The whole text as blark understood it."""
    return blark["HLI.st"]


def test_every_structure_is_understood_with_all_its_members(
    parsed: str,
) -> None:
    """Names and types in order, as the layout has them."""
    assert re.search(
        r"TYPE HLI_EXT_VAR :\s*ARRAY ?\[0\.\.5999\] OF UDINT", parsed
    )
    for cls in (
        c for c in export._st_structures() if c is not layout.HLI_EXT_VAR
    ):
        block = re.search(
            rf"^\s*TYPE {cls.__name__} :\n\s*STRUCT\n(.*?)END_STRUCT",
            parsed,
            re.DOTALL | re.MULTILINE,
        )
        assert block, cls.__name__
        members = re.findall(r"^\s*(\w+) : (.+);$", block[1], re.MULTILINE)
        wanted = [
            export._st_member(name, ctype).removesuffix(";").split(" : ")
            for name, ctype in cls._fields_
        ]
        assert [list(m) for m in members] == wanted


def test_globals_are_understood(parsed: str) -> None:
    """Pointers with their types."""
    assert re.search(
        r"gpCh.*ARRAY ?\[0\.\.11\] OF POINTER TO HLI_CHANNEL", parsed
    )
    assert re.search(r"gpVEGlobal : POINTER TO HLI_EXT_VAR", parsed)


def test_the_oracle_can_fail(blark: dict[str, str]) -> None:
    """A structure that is not closed is refused; nothing else is."""
    assert {name for name, text in blark.items() if "REFUSED" in text} == {
        "bad.st"
    }


def names() -> list[str]:
    found = [cls.__name__ for cls in export._st_structures()]
    found += [
        export.ST_RENAMED.get(n, n)
        for cls in export._st_structures()
        for n, _ in cls._fields_
    ]
    return [*found, *export.st_constants()]


def test_no_name_is_reserved_or_malformed() -> None:
    """Case does not count; no double and no closing underscore (IEC 61131-3, 6.1.2)."""
    for name in names():
        assert name.upper() not in RESERVED, name
        assert IDENTIFIER.match(name), name
    assert len({n.upper() for n in export.st_constants()}) == len(
        export.st_constants()
    )


def test_twincat_project_files(blark: dict[str, str]) -> None:
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
    assert "decoder_mc_control" in blark["HLI_CHANNEL.TcDUT"]
    assert "gpPform" in blark["HLI_Global_Variables.TcGVL"]
    constant = r"name: HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX\n(?:.*\n){1,12}?\s*value: 127"
    assert re.search(constant, blark["HLI_Global_Constants.TcGVL"])


def test_constants_agree_with_the_plc_side() -> None:
    """Mode and state numbers of the function blocks and of the exported constants are one."""
    from plc_client import Mode, ProcessState  # noqa: PLC0415

    constants = export.st_constants()
    for mode in Mode:
        assert constants[f"HLI_IMCM_{mode.name}_MODE"] == mode
    for state in ProcessState:
        assert constants[f"HLI_IMCM_PROCESS_{state.name}"] == state
