"""What values of a setup count in, and what the program gives in their place."""

import dataclasses

import numpy as np
import pytest

from cnc_core.config import parse_config
from cnc_core.frontend.osai.codes import CODES, OWN_UNIT
from cnc_core.optimize import optimize
from support.osai_programs import SETUP_3, SETUP_5, Workshop, changed, shop

__all__ = ["shop"]

AXES = """
[axes.X]
id = 1
[axes.Y]
id = 2
[axes.Z]
id = 4
[axes.A]
kind = "rotary"
id = 5
[axes.B]
kind = "rotary"
id = 6
[osai]
setup_unit = "{}"
"""
POINTS = "G1X0Y0Z0i0j0k1F100\nX10\nX20"
LINEAR = "XYZtw"
FULL = changed(
    SETUP_5,
    VER="(VER,PRG,PRG,PRG)",
    THR="(THR,0.0254,0.001,2,0.0508,0.0762)",
    TOL="(TOL,50.8,12.7,2.54,-90,25.4)",
    CRV="(CRV,2.54,6,G63)",
    AXP_X="(AXP,X,0.0254,,-254,2540)",
    DIN_X="(DIN,X,2540,254,2540,5080,508,5080)",
    AXP_A="(AXP,A,0.5,360,-90,900)",
    DIN_A="(DIN,A,3600,200,2000,7200,400,4000)",
)


def in_inches(setup):
    """Every length of the setup divided by 25.4, in the text alone."""
    lines = []
    for line in setup.splitlines():
        code, *values = line.strip("()").split(",")
        for i, spec in enumerate(CODES.get(code, ())):
            own = code in OWN_UNIT and values[0] not in LINEAR
            if spec.length and not own and i < len(values) and values[i]:
                values[i] = repr(float(values[i]) / 25.4)
        lines.append(f"({','.join([code, *values])})" if values else line)
    return "\n".join(lines) + "\n"


def spec_of(shop: Workshop, body, setup, **options):
    program = shop.profile(body, setup, **options)
    while (item := program.reader.read(100)) is not None:
        if getattr(item, "profile", None) is not None:
            return item.profile.spec
    raise AssertionError("no profile")


def values(item):
    """Every value of a specification, by its place in it."""
    if dataclasses.is_dataclass(item):
        item = {f.name: getattr(item, f.name) for f in dataclasses.fields(item)}
    if isinstance(item, dict):
        return [v for value in item.values() for v in values(value)]
    if isinstance(item, np.ndarray):
        item = item.tolist()
    if isinstance(item, (list, tuple)):
        return [v for value in item for v in values(value)]
    return [item]


def test_lengths_of_a_setup_may_be_inches(shop):
    """`setup_unit = "inch"`: tolerances, tool, offsets and limits of linear
    axes are inches; angles, ratios, versors and rotary axes are not.
    """
    mm = spec_of(shop, POINTS, FULL, cell=parse_config(AXES.format("mm")))
    inch = spec_of(
        shop, POINTS, in_inches(FULL), cell=parse_config(AXES.format("inch"))
    )
    assert mm.tolerance == 0.0254
    assert mm.tool.length == 50.8
    for one, other in zip(values(mm), values(inch), strict=True):
        numeric = isinstance(one, float)
        assert other == (pytest.approx(one, rel=1e-12) if numeric else one)


@pytest.mark.ci
def test_the_optimizer_takes_a_setup_in_inches(shop):
    """The same polynomials as from the setup in mm; the output's setup stays
    in inches, because the same cell runs it.
    """
    smt = "(SMT,0.01,0.01,0.001,0.1,0.1,0.1,G66,G66,G66)"
    texts, setups = [], []
    for unit, turned in (("mm", lambda text: text), ("inch", in_inches)):
        cell = parse_config(f'[osai]\nsetup_unit = "{unit}"\n')
        setup, source, out = (
            shop.folder / f"{unit}{name}"
            for name in ("_setup", ".osai", "_out")
        )
        setup.write_text(turned(SETUP_3 + smt + "\n"))
        points = "\n".join(f"X{i}Y{i * i / 20:.5f}" for i in range(1, 12))
        source.write_text(
            f"(HSM,{setup.name})\nG61\nG1X0Y0Z0F500\n{points}\nG60\n"
        )
        optimize(source, setup, out, cell)
        texts.append(out.read_text().replace(unit, ""))
        setups.append((shop.folder / f"{unit}_out.setup").read_text())
    numbers = [t.replace(",", " ").split() for t in texts]
    for one, other in zip(*numbers, strict=True):
        try:
            assert float(other) == pytest.approx(float(one), abs=1e-7)
        except ValueError:
            assert other == one
    assert "(THR,0.01," in setups[0]
    assert "(THR,0.000393700787402," in setups[1]


@pytest.mark.parametrize(
    ("before", "jrk", "wanted"),
    [
        ("", "", None),
        ("JRS=2", "", 2.0),
        ("JRS=2", "0.5", 0.5),
        ("E1=3\nN5 JRS=E1/2", "", 1.5),
        ("JRS=2\nE1=JRS*2\nJRS=E1", "", 4.0),
        ("JRS=2", "E1", 0.0),
    ],
)
def test_jrs_of_the_program(shop, before, jrk, wanted):
    """JRK without Jrs takes the JRS that is active at G61."""
    setup = changed(SETUP_3, JRK=f"(JRK,ENA,{jrk},,,,)")
    text = f"{before}\n(HSM,CONFIG1)\nG61\nX0Y0Z0F100\nX1\nX2\nG60\n"
    program = shop.program(text, setup)
    found = []
    while (item := program.reader.read(100)) is not None:
        if getattr(item, "profile", None) is not None:
            found.append(item.profile.spec.smoothness.scale)
    assert found[0] == wanted


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        (",,,,,,,,,", []),
        (",,,,,,,,ENA,", ["C1"]),
        (",,,,,,,,ENA,DIS", ["C1", "Progr"]),
    ],
)
def test_fields_without_effect_are_told(shop, fields, told):
    """SMS C1 ENA and Progr DIS change nothing: a warning with their place."""
    setup = SETUP_3 + f"(SMS,{fields})\n"
    program = shop.profile("X0Y0Z0F100\nX1", setup)
    while program.read(100) is not None:
        pass
    found = [w for w in program.reader.warnings if w.code == 909270]
    assert [w.text.split(":")[0] for w in found] == [f"SMS, {t}" for t in told]
    assert all(w.place.file.endswith("CONFIG1") for w in found)
    assert all(w.place.line == setup.count("\n") for w in found)


@pytest.mark.parametrize("rows", [1, 2, 3, 100])
def test_null_moves_keep_the_end(shop, rows):
    """However the points are read, the profile ends at its last point."""
    setup = changed(SETUP_3, THR="(THR,0.01,0.0001,0,0.05,0.05)")
    program = shop.profile("X0Y0Z0F100\nX1\nX2\nX2.01\nX2.02\nX2.04", setup)
    ends = []
    while (batch := program.read(rows)) is not None:
        ends += [float(row["end"][0]) for row in getattr(batch, "rows", ())]
    assert ends[-1] == pytest.approx(2.04, abs=1e-12)
    assert 2.0 not in ends
