%INCH
G70 G01 X1 F10
G91 X1 Y-0.5 A90
G02 X1 Y1 R1
A90 I1 ; full circle, A along
G01 A-90 ; degrees a minute
G71 X10
G90 G00 X0
