V.E.GO = 3
G00 X[V.E.GO]
V.E.A.B[2] = 1.5
X[V.E.A.B[2]]
V.E.GO=-1
X[V.E.A.B[3]]
X[V.E.NO]
