; three holes of its own: the table is called B here
N10 G00 X0 Z5
$FOR P1 = 1, 3, 1
#WAIT [ID=1 CH=2]
#CALL AX [B, 10, 2]
G91 G01 B20 F3000
G90 G01 Z-1 F1200
G00 Z5
#PUT AX [B]
#SIGNAL [ID=2 CH=2]
$ENDFOR
M30
