"""The three-letter codes of setup files: fields, values, what may be left out
(specification 9).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Field:
    """One field.  ``words``: the names it may have; empty: a number within
    ``low``..``high``, whole if ``whole``.  ``length``: it counts in the unit of
    setups; where the code is one of an axis' own unit, on linear axes only.
    """

    name: str
    words: tuple[str, ...] = ()
    optional: bool = False
    default: float | str | None = None
    low: float = -1e9
    high: float = 1e9
    whole: bool = False
    letter: bool = False  # an axis name
    length: bool = False


EDGE_MODES = ("G63", "G66", "G67")


def _number(name: str, low: float = -1e9, high: float = 1e9) -> Field:
    return Field(name, low=low, high=high)


def _length(name: str, low: float = -1e9) -> Field:
    return Field(name, low=low, length=True)


def _open(name: str, low: float = -1e9, default: float | None = None) -> Field:
    return Field(name, optional=True, low=low, default=default)


def _open_length(
    name: str, low: float = -1e9, default: float | None = None
) -> Field:
    return Field(name, optional=True, low=low, default=default, length=True)


POINTS = ("CCP", "CLP", "AXI")
SOURCES = ("PRG", "REL")
NAME = Field("Name", letter=True)
CHAINS = ("WRK", "MIX", "TOL", "WC1", "WC2", "TC1", "TC2", "C12")
BEDS = ("WRK", "B12", "BC1", "B23", "BC2", "TOL")

CODES: dict[str, tuple[Field, ...]] = {
    "PNT": (
        Field("Type", POINTS),
        Field("Param", POINTS),
        Field("Poly", ("CUB", "QUI")),
        Field("Format", ("PNT", "POL", "BSP"), optional=True, default="PNT"),
    ),
    "VER": (
        Field("Ijk", SOURCES),
        Field("Mno", SOURCES),
        Field("Pqd", SOURCES),
    ),
    "JRK": (
        Field("Mode", ("ENA", "DIS", "AXI")),
        _open("Jrs", 0.0),
        Field("Entities", optional=True, low=0.0, whole=True, default=0.0),
        _open("Tstab", 0.0, 0.0),
        _open("Tintgr", 0.0, 0.0),
        _open("Ttop", 0.0, 0.0),
    ),
    "THR": (
        _length("Tol", 0.0),
        _number("TolV", 0.0),
        _number("Scale", 0.0),
        _length("NullMov", 0.0),
        _length("Chord", 0.0),
    ),
    "TOL": (
        _open_length("Len"),
        _open_length("Radius", 0.0),
        _length("EdgeRad", 0.0),
        _number("Angle", -180.0, 180.0),
        _open_length("OriginLen", default=0.0),
    ),
    "TOD": (_number("Xcomp"), _number("Ycomp"), _number("Zcomp")),
    "CRV": (
        _length("Len", 0.0),
        _number("Ratio", 0.0),
        Field("Mode", ("G62", "G63")),
    ),
    "EDG": (
        _number("Angle", 0.0, 180.0),
        _number("VAngle", 0.0, 180.0),
        Field("Mode", ("G63", "G66", "G67")),
        _number("Acc", 0.0),
    ),
    "AXI": (
        NAME,
        Field("Id", low=1.0, high=65535.0, whole=True),
        Field("Type", ("ABS", "ORD", "VRT", "TAN", "TAO", "OTH")),
        Field("CinType", ("LI1", "LI2", "LI3", "WRK", "TOL", "OTH")),
        Field("Diam", ("ENA", "DIS"), optional=True, default="DIS"),
    ),
    "AXP": (
        NAME,
        _length("NullMov", 0.0),
        _open_length("Pitch", 0.0),
        _open_length("Lim-"),
        _open_length("Lim+"),
    ),
    "DIN": (
        NAME,
        *(
            _open_length(name, 1e-6)
            for name in ("Vmax", "Amax", "Jmax", "Vrap", "Arap", "Jrap")
        ),
    ),
    "MAC": (Field("Type", CHAINS), Field("Bed", BEDS)),
    "CIN": (
        NAME,
        *(_length(name) for name in ("OffX", "OffY", "OffZ")),
        *(_number(name) for name in ("RotX", "RotY", "RotZ")),
    ),
    "SMT": (
        _length("Toll", 0.0),
        _length("TollX", 0.0),
        _number("TollV", 0.0),
        *(_length(name, 0.0) for name in ("Racc", "RaccX", "RaccV")),
        *(Field(name, EDGE_MODES) for name in ("C0", "C0X", "C0V")),
    ),
    "SMS": (
        *(
            Field(name, optional=True, low=0.0, high=1.0, default=0.5)
            for name in ("Split", "SplitX", "SplitV")
        ),
        *(
            Field(
                name, optional=True, low=1.0, high=3.0, whole=True, default=2.0
            )
            for name in ("Cond", "CondX", "CondV")
        ),
        _open_length("Len", 0.0),
        Field(
            "Pnt",
            optional=True,
            low=100.0,
            high=10000.0,
            whole=True,
            default=1000.0,
        ),
        Field("C1", ("ENA", "DIS"), optional=True, default="DIS"),
        Field("Progr", ("ENA", "DIS"), optional=True, default="ENA"),
    ),
}
PER_AXIS = ("AXI", "AXP", "DIN", "CIN")  # once for each name
OWN_UNIT = ("AXP", "DIN")  # mm of a linear axis, degrees of a rotary one
REQUIRED = ("PNT", "VER", "THR", "AXI")
FEED_ON = {
    "CCP": ("CCP", "CLP"),
    "CLP": ("CLP",),
    "AXI": ("AXI", "CLP"),
}
AXES_MAX = 6
TRANSITIONS = (62, 63, 66, 67)
VIRTUALISATIONS = ("UPR", "UVP", "UVC", "TCP")
