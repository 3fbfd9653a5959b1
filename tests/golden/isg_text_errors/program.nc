V.P.T="abc"
X[V.P.T]
V.P.T=5
V.P.N=1
V.P.N="a"
P1=DELETE[V.P.T,1,9]
V.P.T=MID[V.P.T,1,0]
V.P.X="a"*2
