V.P.A.B = 3
G00 X[v.p.a.b]
X[V.P.NONE]
