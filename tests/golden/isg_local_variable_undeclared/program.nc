V.L.A=1
