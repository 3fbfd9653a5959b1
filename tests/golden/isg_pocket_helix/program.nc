D1 G00 Z50
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=20 @P3=2 @P4=5 @P5=2.5 @P6=4 @P20=600 @P21=300 @P72=30 @P73=20 @P32=2 @P7=1 @P8=3 @P30="UpCutMilling"]
L CYCLE [NAME=SysMillRectangularPocket.ecy @P1=0 @P2=20 @P3=2 @P4=5 @P5=2.5 @P6=4 @P20=600 @P21=300 @P72=30 @P73=20 @P31=3]
M30
