D1
L CYCLE [NAME=SysMillRectangularPocket.ecy]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=-1 @P3=-2 @P4=0 @P5=0 @P6=11 @P72=9 @P73=20 @P20=-1 @P21=0 @P31="Both" @P30=2]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=1 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P21=1 @P65=4 @P7=0 @P40=3 @P15=3]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=1 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P21=1 @P65=11 @P32=2 @P8=6 @P41=3]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=2 @P3=2 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P13=0 @P32=3 @P34=0 @P42=361 @P171=0]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=0 @P4=3 @P5=1 @P6=5 @P72=14.9 @P73=20 @P20=1 @P70=1 @P75=2 @P199=1]
G41 G01 X10 F100
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=5 @P3=1 @P4=3 @P5=1 @P6=5 @P72=30 @P73=20 @P20=1 @P21=1]
G40
$IF 0
L CYCLE [NAME=SysHscSettings @P2=1]
$ENDIF
M30
