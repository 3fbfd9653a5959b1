$IF 0
L CYCLE [NAME=SysCalcCircle.ecy @P50=0 @P60=V.P.X @P51=1e]
L CYCLE [NAME=SysCalcCircle.ecy @P50=0 @P60=V.P.X @P51="a" @P61=0]
L CYCLE [NAME=SysHscSettings @P1=7]
L CYCLE [NAME=V.P.N @P1=7]
L CYCLE [NAME=own.ecy @P1=7]
$ENDIF
M30
%L SUB
L CYCLE [NAME=SysHscSettings @P1=0]
M17
