%POCKETS
( three pockets at the places of a call pattern, the second one turned by 60 degrees and 5 mm higher )
T8 D8                                ( tool )
M6                                   ( change )
G54 G90 S6000 M03
#VAR
  V.CYC.PatternRetract = 100
  V.CYC.PatternID      = 1
  ; cycle inputs
  V.L.SurfacePosition = 0            ( surface, Z )
  V.L.RetractionPlane = 50
  V.L.SafetyClearance = 2            ( relative )
  V.L.DepthOfPocket   = 12
  V.L.MaxIncrementZ   = 4
  V.L.MaxIncrementXY  = V.G.WZ_AKT.R
  V.L.FeedRateXY      = 6000
  V.L.FeedRateZ       = 4000
  V.L.PocketLength    = 30
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
L CYCLE [NAME=SysMillRectangularPocket.ecy \
  @P1=V.L.SurfacePosition @P2=V.L.RetractionPlane @P3=V.L.SafetyClearance \
  @P4=V.L.DepthOfPocket @P5=V.L.MaxIncrementZ @P6=V.L.MaxIncrementXY \
  @P20=V.L.FeedRateXY @P21=V.L.FeedRateZ \
  @P31="Roughing+Finishing" @P15=0.2 @P16=0.3 ( allowances ) @P32=2 @P7=1 @P8=2 ( helical plunge ) \
  @P72=V.L.PocketLength @P73=V.L.PocketWidth @P65=6 \
  PATTERN_ID=V.CYC.PatternID PATTERN_RETRACT=V.CYC.PatternRetract \
  ]
G260
M05
M30
