%arc_line_arc
( two half circles with a line between them: the axes slow the arcs down )
N10 G17 G90 G71
N20 G00 X0 Y0
N30 G03 X40 Y0 I20 J0 F12000
N40 G01 X80
N50 G03 X120 Y0 I20 J0
N60 M30
