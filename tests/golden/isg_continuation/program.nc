%CONTINUED (a backslash continues any block) 
; also a comment \
G01 X99 F1 this is still the comment
N10 G01 X10 \
N11 Y[5 + \
5] F600
( nested ( comment ) G00 X50 ) Y20
X30 ( open comment swallows Y99
N20 X40 (plain comment) ; the rest
X1\
\

Y30 ; no break behind the last line \
