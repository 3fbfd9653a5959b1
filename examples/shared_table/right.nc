; three holes; between them the table belongs to the left drill
N10 G00 X0 Z5
$FOR P1 = 1, 3, 1
G91 G01 C40 F3000
G90 G01 Z-2 F1200
G00 Z5
#PUT AX [C]
#SIGNAL [ID=1 CH=1]
G00 X[5 * P1]
#WAIT [ID=2 CH=1]
#CALL AX [C, 10, 2]
$ENDFOR
M30
