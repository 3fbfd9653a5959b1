V.P.T="Hello World"
#MSG ["%s|%s|%s", LEFT[V.P.T,5], RIGHT[V.P.T,5], MID[V.P.T,3,7]]
#MSG ["%d %d %d", LEN[V.P.T], FIND[V.P.T,"World"], FIND[V.P.T,"world"]]
#MSG ["%s %s %s", DELETE[V.P.T,6,6], INSERT[V.P.T,"x",5], REPLACE[V.P.T,"J",1,1]]
#MSG ["%d", ORD[V.P.T,1]]
