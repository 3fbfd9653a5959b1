G00 X1
L sub.nc
X2
