"""The tables of docs/isons.md against the code: every function, instruction, variable, property and parameter."""

import re
from pathlib import Path

import pytest

from cnc_core.frontend.isons.base import codes, parameters
from cnc_core.frontend.isons.base.machine import EVENTS
from cnc_core.frontend.isons.flow import instructions
from cnc_core.frontend.isons.language.formulas import FUNCTIONS, OF_ANGLES, OPERATORS, TO_ANGLES
from cnc_core.frontend.isons.motion.system import INDICES
from cnc_core.frontend.isons.operator.dialogs import KNOWN as FORM_INSTRUCTIONS
from cnc_core.frontend.isons.operator.forms import PROPERTIES

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "isons.md").read_text()


def section(title):
    return re.split(r"\n#+ ", PAGE.split(f"# {title}\n", 1)[1], maxsplit=1)[0]


def test_every_g_function_has_its_row():
    """The first cells of the tables, ranges taken apart, are what the dialect knows."""
    found = set()
    for title in ("G functions", "Interpolation modes and filters"):
        for line in section(title).splitlines():
            cell = line.split("|")[1] if line.startswith("| ") else ""
            for first, last in re.findall(r"\b(\d+)(?:-(\d+))?\b", cell):
                found |= set(range(int(first), int(last or first) + 1))
    assert found == set(codes.KNOWN)


def named(word):
    return re.search(rf"(?<![A-Z_]){re.escape(word)}(?![A-Z_])", PAGE) is not None


@pytest.mark.parametrize(
    "words",
    [
        [*instructions._TABLE, *instructions._POSITIONERS],
        [*FORM_INSTRUCTIONS, "LIB_MESSAGE", "LIB_SHOWFORM", "LIB_CLOSEFORM", "LIB_INPUTSETVALUE"],
        [*FUNCTIONS, *OF_ANGLES, *TO_ANGLES],
        list(PROPERTIES),
        list(EVENTS),
        [f"$_{family}" for family in INDICES],
        ["USER_ZERO", "USER_OFFSET", "PAUSE_MODE", "RESUME_T", "--answers", "--start-line", "--start-marker"],
    ],
    ids=["instructions", "forms", "functions", "properties", "events", "families", "words"],
)
def test_every_word_is_named(words):
    """Instructions, properties, functions, events, families of system variables."""
    assert [word for word in words if not named(word)] == []


def test_every_operator_is_named():
    """As the specification writes them."""
    row = next(line for line in PAGE.splitlines() if "precedence as the specification" in line).replace("\\|", "|")
    assert [name for name in OPERATORS if name not in row] == []


@pytest.mark.parametrize(
    ("table", "ending"),
    [(parameters.GENERIC, ""), (parameters.AXIS, "_X"), (parameters.POSITIONER, "_P0")],
    ids=["generic", "axis", "positioner"],
)
def test_every_parameter_has_its_row(table, ending):
    """Name, default, whether it acts or is stored, and the code's reason."""
    for name, known in table.items():
        default = "none" if abs(known.default) >= 1e11 else f"{known.default:g}"
        state = f"stored: {known.stored}" if known.stored else f"acts: {known.acts}"
        assert f"| `{name}{ending}` | {default} | {state} |" in PAGE
