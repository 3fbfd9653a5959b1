P1=1
G00
$IF P1 == 1 $GOTO [A]
X1
[A]
X2
$IF P1 == 2 $GOTO [A]
X3
