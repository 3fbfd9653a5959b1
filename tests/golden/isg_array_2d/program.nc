#VAR
V.P.A[2][3] = [1,2,3,4,5,6]
#ENDVAR
G00 X[V.P.A[1][0]] Y[V.P.A[0,2]] Z[V.P.A[1][2]]
X[V.P.A[1]]
