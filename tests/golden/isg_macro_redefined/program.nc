$FOR P1=1,2,1
G00 "M"
"M" = "X[P1]"
$ENDFOR
