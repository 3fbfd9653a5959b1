( the required parameters alone: both modes, helical plunge, infeed in a semicircle, F in force )
D1 G00 Z50 F500
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=20 @P3=2 @P4=5 @P5=2.5 @P6=4 @P72=30 @P73=20]
( accepted, told once where they would change something )
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=20 @P3=2 @P4=2 @P5=2.5 @P6=4 @P72=30 @P73=20 @P32=1 @P34=1 @P7=1 @P135=1 @P170=4 @P171=400]
M30
