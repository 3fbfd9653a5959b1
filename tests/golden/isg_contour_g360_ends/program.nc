; one group: exact stop ends contouring, contouring ends exact stop
G261 G01 F100 X1
G360 X2
X3
G261 X4
G260
