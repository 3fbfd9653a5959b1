"""The page of the IsoNs dialect names every word that the code knows."""

import re
from pathlib import Path

import pytest

from cnc_core.frontend.isons.base.machine import EVENTS
from cnc_core.frontend.isons.flow import instructions
from cnc_core.frontend.isons.language.formulas import (
    FUNCTIONS,
    OF_ANGLES,
    OPERATORS,
    TO_ANGLES,
)
from cnc_core.frontend.isons.motion.system import INDICES
from cnc_core.frontend.isons.operator.dialogs import KNOWN as FORM_INSTRUCTIONS
from cnc_core.frontend.isons.operator.forms import PROPERTIES

PAGE = (
    Path(__file__).resolve().parents[2] / "docs" / "reference" / "isons.md"
).read_text()


def named(word):
    return (
        re.search(rf"(?<![A-Z_]){re.escape(word)}(?![A-Z_])", PAGE) is not None
    )


@pytest.mark.parametrize(
    "words",
    [
        [*instructions.TABLE, *instructions._POSITIONERS],
        [
            *FORM_INSTRUCTIONS,
            "LIB_MESSAGE",
            "LIB_SHOWFORM",
            "LIB_CLOSEFORM",
            "LIB_INPUTSETVALUE",
        ],
        [*FUNCTIONS, *OF_ANGLES, *TO_ANGLES],
        list(PROPERTIES),
        list(EVENTS),
        [f"$_{family}" for family in INDICES],
        [
            "USER_ZERO",
            "USER_OFFSET",
            "PAUSE_MODE",
            "RESUME_T",
            "--answers",
            "--start-line",
            "--start-marker",
        ],
    ],
    ids=[
        "instructions",
        "forms",
        "functions",
        "properties",
        "events",
        "families",
        "words",
    ],
)
def test_every_word_is_named(words):
    """Instructions, properties, functions, events, families of system variables."""
    assert [word for word in words if not named(word)] == []


def test_every_operator_is_named():
    """As the specification writes them."""
    rows = (line for line in PAGE.splitlines() if "precedence as" in line)
    row = next(rows).replace("\\|", "|")
    assert [name for name in OPERATORS if name not in row] == []
