G00
$GOTO [end]
X1
[END]
X2
