"M" = "X5 Y[P1]"
P1=2
G00 "M" Z1
"M"
