#VAR
P10[4] = [1, 2, \
 3, 4]
#ENDVAR
G00 X[P10[3]]
