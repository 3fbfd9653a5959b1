D1
L CYCLE [NAME=SysMillRectangularPocket.ecy]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=-1 @P3=-2 @P4=0 @P5=0 @P6=11 @P72=9 @P73=20 @P20=-1 @P21=0 @P31="Both" @P30=2]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=1 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P21=1 @P74=4 @P7=1 @P70=3 @P15=3]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=1 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P21=1 @P74=11 @P32=2 @P8=6 @P71=3]
G41 G01 X10 F100
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=1 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P21=1]
G40
M30
