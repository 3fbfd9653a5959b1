G00 X1 (a (nested) b) Y1 ; end
(open X2
X3
