"S" = "sub.nc"
G00
L "S"
