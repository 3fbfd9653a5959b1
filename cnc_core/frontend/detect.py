"""The dialect of a program, from its text or its extension."""

from __future__ import annotations

import re
from pathlib import Path

from cnc_core.errors import CncError, Place
from cnc_core.files import open_regular

DEFAULT_DIALECT = "isg"
EXTENSIONS = (
    {".nc": "isg", ".cyc": "isg", ".ecy": "isg"}
    | dict.fromkeys((".iso", ".ngc", ".tap", ".gcode", ".cnc"), "iso")
    | {".isons": "isons", ".osai": "osai", ".hsm": "osai"}
)
OWN_EXTENSIONS = (".isons", ".osai")  # of one dialect only
# kinds of files that are taken for programs by mistake
_PLC = "a PLC program; give it by --plc, behind the NC program"
_RECORDING = "a recording; hli-cosim inspect looks into it"
OTHER_KINDS = (
    dict.fromkeys((".py", ".st"), _PLC)
    | {".toml": "a cell file; give it by --config, behind the NC program"}
    | dict.fromkeys((".npz", ".parquet", ".mcap"), _RECORDING)
)
SNIFFED_BYTES = 65536
_COMMENT = re.compile(r"\([^()\n]*\)|;[^\n]*")
# Signs of one dialect that a program of the other cannot contain, in capitals.
# Those that begin with a letter look behind it at what stands ahead of it:
# ``re`` finds a letter twenty times as fast.
_SIGNS = {
    dialect: [re.compile(sign, re.M) for sign in signs]
    for dialect, signs in {
        "isg": (
            r"#\s*[A-Z]{2,}",
            r"\$(?:IF|ELSE|FOR|WHILE|DO|REPEAT|SWITCH|GOTO)\b",
            r"V(?<!\wV)\.[A-Z]+\.",
            r"^\s*%L\s",
        ),
        "iso": (
            r"\A[\s%]*O\s*\d+\s*?$",
            r"#<",
            r"#\s*\d+\s*=",
            r"G(?<![A-Z\d.]G)4[39](?![\d=])",
            r"G(?<![A-Z\d.]G)(?:59|9[012]|28|30|61|43)\.[1-9]",
        ),
        "isons": (
            r"^\s*(?:END_IF|END_LOOP|END_PROGRAM|USER_ZERO|USER_OFFSET|GOSUB"
            r"|MARKER|DIM)\b",
            r"^\s*@\w+\s*$",
            r"\$(?!IF\b)[A-Z_]\w*\s*=",
            r"[A-Z]\s*\[[^\]\n]*\$",
        ),
    }.items()
}


# three-letter codes look like comments, so they are searched for in the text as
# it stands
_HSM = re.compile(r"^\s*(?:N\d+\s*)?\(\s*HSM\s*,[^()\n]*\)\s*$|^\s*<\*,", re.M)


def detect(path: Path) -> str:
    """The dialect of a file.

    An extension of one dialect only decides. Else signs of a single dialect in
    the first 64 KiB decide. Else the extension does.

    CncError 901010: the extension is that of a PLC program, a cell file or a
    recording.
    """
    kind = OTHER_KINDS.get(path.suffix.lower())
    if kind and path.exists():
        text = f"no NC program but {kind}"
        raise CncError(901010, text, Place(str(path)))
    by_name = EXTENSIONS.get(path.suffix.lower(), DEFAULT_DIALECT)
    if path.suffix.lower() in OWN_EXTENSIONS:
        return by_name
    try:
        with open_regular(path) as file:
            begin = file.read(SNIFFED_BYTES)
    except (CncError, OSError):
        return by_name  # the reader reports it
    if _HSM.search(begin.decode("latin-1")):
        return "osai"
    text = _COMMENT.sub(" ", begin.upper().decode("latin-1"))
    found = [
        dialect
        for dialect, signs in _SIGNS.items()
        if any(sign.search(text) for sign in signs)
    ]
    return found[0] if len(found) == 1 else by_name
