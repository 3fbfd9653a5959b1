"""The programs that the vendor's cycle manual prints, as they stand there."""

from pathlib import Path

import numpy as np
import pytest

from cnc_core.config import CellConfig, parse_config
from cnc_core.program import Program

PAT_1 = """T8 D8                                ( tool )
M6                                   ( change )
G54 G90 S6000 M03
#VAR
  V.CYC.PatternRetract = 100
  V.CYC.PatternID      = 1
  ; cycle inputs
  V.L.SurfacePosition = 0    ( surface, Z )
  V.L.RetractionPlane = 50
  V.L.SafetyClearance = 2    ( relative )
  V.L.DepthOfPocket   = 12
  V.L.MaxIncrementZ   = 4
  V.L.MaxIncrementXY  = V.G.WZ_AKT.R
  V.L.FeedRateXY      = 6000
  V.L.FeedRateZ       = 4000
  V.L.MachiningMode   = 1
  V.L.PocketLength    = 20
  V.L.PocketWidth     = 20
#ENDVAR
#PATTERN BEGIN [ID=V.CYC.PatternID]
#AT [100, 0, 0]
#AT [100, 100, 5, 0, 0, 60]
#AT [0, 100, 10]
#PATTERN END
#CONTOUR MODE [DEV, PATH_DEV = V.G.WZ_AKT.R / 100]
G261
G00 Z60
G00 X50 Y50
L CYCLE [NAME=SysMillRectangularPocket.ecy \\
  @P1=V.L.SurfacePosition @P2=V.L.RetractionPlane @P3=V.L.SafetyClearance \\
  @P4=V.L.DepthOfPocket @P5=V.L.MaxIncrementZ @P6=V.L.MaxIncrementXY \\
  @P20=V.L.FeedRateXY @P21=V.L.FeedRateZ @P31=V.L.MachiningMode \\
  @P72=V.L.PocketLength @P73=V.L.PocketWidth \\
  PATTERN_ID=V.CYC.PatternID PATTERN_RETRACT=V.CYC.PatternRetract \\
  ]
G260
M05
M30
"""
# centre, surface, turn in degrees
PLACES = [
    (100.0, 0.0, 0.0, 0.0),
    (100.0, 100.0, 5.0, 60.0),
    (0.0, 100.0, 10.0, 0.0),
]

RTP_1 = """( RTP-1 ISG )
#TRAFO ON
L CYCLE [NAME=SysPosRotationToPlane.ecy \\
  @P1=1 @P2=50 @P3=140 @P4=0 @P5=-80 \\
  @P6=100 @P7=30 @P8=-25 @P9=100 @P10=70 @P11=-25 @P12=115 @P13=70 @P14=-50 \\
  ]
( machine the plane )
#CS OFF ; end of the calculated MCS
#TRAFO OFF
"""
RTP_2 = """( RTP-2 ISG )
#TRAFO ON
L CYCLE [NAME=SysPosRotationToPlane.ecy \\
  @P1=1 @P2=50 @P3=140 @P4=0 @P5=-80 @P15=60 @P16=0 @P17=90 \\
  ]
( machine the plane )
#CS OFF
#TRAFO OFF
M30
"""
BEC = {
    "@P5=-80": "@P5=80",
    "P8=-25": "P8=25",
    "P11=-25": "P11=25",
    "P14=-50": "P14=50",
}

HSC_1 = """T9 D9
M6
G00 G17 G90 F2000 M03 S6000
G00 Z150
G00 X0 Y0
L CYCLE [NAME=SysHscSettings.ecy \\
        @P1 = 4 \\
        ]
M30
"""
DESELECT = """% manufacturerHscDeselectSettings.nc
G133 = 100
G134 = 100
#HSC OFF
#FILTER OFF
M17
"""
FINISH = """% manufacturerHscFinishSettings.nc
; G133 = 80
; G134 = 80
; #SLOPE[TYPE=HSC]
; #HSC ON[SURFACE PATH_DEV=V.G.HSCS.FINISH.TOLERANCE \\
TRACK_DEV=V.G.HSCS.FINISH.TOLERANCE]
; #FILTER ON [AX_DEV=V.G.HSCS.FINISH.TOLERANCE]
M17
"""

AXES = "".join(f"[axes.{n}]\n" for n in "XYZ")
FIVE = (
    AXES
    + """
[axes.A]
kind = "rotary"
[axes.C]
kind = "rotary"
[kinematics.9]
type = "table-table"
rotary = ["C", "A"]
directions = { A = [-1.0, 0.0, 0.0], C = [0.0, 0.0, -1.0] }
points = { A = [0.0, 0.0, -50.0], C = [0.0, 0.0, 0.0] }
"""
)


def ends(folder: Path, text: str, cell: CellConfig) -> np.ndarray:
    """(n, axes) ends of the programmed motions."""
    path = folder / "main.nc"
    path.write_text(text)
    program = Program(path, cell, programmed=True)
    rows = np.concatenate([batch.rows for batch in program.batches()])
    program.reader.close()
    return np.array(rows[rows["type"] <= 3]["end"][:, : len(cell.axes)])


def test_pattern_of_pockets(tmp_path: Path) -> None:
    """PAT-1: order of the places, planes, three infeeds, corners turned with the place."""
    cell = parse_config(AXES + "[tools.8]\nradius_mm = 5.0\n")
    points = ends(tmp_path, PAT_1, cell)
    above = points[points[:, 2] == 100.0][:, :2]
    reached = []
    for x, y, surface, turn in PLACES:
        away = np.hypot(*(above - [x, y]).T)
        assert away.min() < 0.5  # the corner there is rounded
        reached.append(int(away.argmin()))
        near = points[np.hypot(*(points[:, :2] - [x, y]).T) < 14.0]
        assert near[:, 2].min() == pytest.approx(surface - 12, abs=1e-9)
        levels = {round(float(z), 6) for z in near[:, 2]}
        assert {surface - 4, surface - 8, surface + 50} <= levels
        angle = np.radians(turn)
        axes = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        cut = ((near[:, :2] - [x, y]) @ axes)[near[:, 2] < surface]
        assert np.abs(cut).max() == pytest.approx(5.0, abs=1e-6)
    assert reached == sorted(reached)


@pytest.mark.parametrize("edition", ["ISG", "BEC"])
@pytest.mark.parametrize("text", [RTP_1, RTP_2], ids=["RTP-1", "RTP-2"])
def test_rotation_to_the_plane(tmp_path: Path, text: str, edition: str) -> None:
    """The tool is turned to the plane's normal: 50 up, then rotary axes alone."""
    angle = 59.036243 if text is RTP_1 else 60.0
    if edition == "BEC":
        for old, new in BEC.items():
            text = text.replace(old, new)
        text = text.replace("@P15=60", "@P15=-60")
    points = ends(tmp_path, text, parse_config(FIVE))
    assert points[0][:3] == pytest.approx([0, 0, 50])
    assert abs(points[-1][3]) == pytest.approx(angle, abs=1e-5)
    assert points[-1][:3] == pytest.approx(points[0][:3])


def test_settings_for_high_speed_cutting(tmp_path: Path) -> None:
    """HSC-1: the subprograms run as they are printed, the position stays."""
    (tmp_path / "manufacturerHscFinishSettings.nc").write_text(FINISH)
    (tmp_path / "manufacturerHscDeselectSettings.nc").write_text(DESELECT)
    cell = parse_config(
        AXES
        + "[tools.9]\nradius_mm = 5.0\n[channel.hscs.finish]\n"
        + 'prog = "manufacturerHscFinishSettings.nc"\ntolerance = 100\n'
        + "[channel.hscs.deselect]\n"
        + 'prog = "manufacturerHscDeselectSettings.nc"\n'
    )
    for text in (
        HSC_1,
        HSC_1.replace("@P1 = 4", "@P1 = 1"),
        HSC_1.replace("@P1 = 4", ""),
    ):
        assert ends(tmp_path, text, cell)[-1] == pytest.approx([0, 0, 150])
    uncommented = FINISH.replace("; ", "")
    (tmp_path / "manufacturerHscFinishSettings.nc").write_text(uncommented)
    assert ends(tmp_path, HSC_1, cell)[-1] == pytest.approx([0, 0, 150])
