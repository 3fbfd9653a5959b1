%CIRCLES
G90 G17 G01 F600 X10 Y0
G03 X0 Y10 I-10 J0
G02 X10 Y0 R10 ; shorter arc
G02 X0 Y-10 R-10 ; longer arc
R=20 ; only stores
G03 X20 Y10 ; R is modal
G02 I5 J0 ; full circle
X20 Y10 I-5 ; end is start: full circle
G161 G03 X30 Y20 I20 J20
G162 G02 X40.001 Y20 I5 J0 ; centre moved onto the bisector
G03 X60 Y20 R9.9 ; chord little longer than 2R: semicircle
G01 X0 Y0
G03 X10 Y10 Z5 I10 J0 ; helix
G02 X0 Y0 Z-20 I-10 J0 K10 ; helix with pitch: two turns and a part
X0 Y0 Z-40 I10 K10 ; two turns exactly
