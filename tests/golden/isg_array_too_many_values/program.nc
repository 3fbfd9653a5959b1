#VAR
V.P.A[2] = [1,2,3]
#ENDVAR
