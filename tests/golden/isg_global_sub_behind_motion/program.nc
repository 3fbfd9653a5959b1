G00 X5 L sub.nc
X6
