V.P.N = "sub.nc"
G00
L V.P.N
