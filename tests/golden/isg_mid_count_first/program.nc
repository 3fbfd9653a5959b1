V.P.T="abcdef"
#MSG ["%s", MID[V.P.T,2,4]]
