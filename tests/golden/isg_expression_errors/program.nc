X[1+]
X[*2]
X[SIN 5]
X[MIN[1]]
X[]
Y[1,2]
X[1+2
