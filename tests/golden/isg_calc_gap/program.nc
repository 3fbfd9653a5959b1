%L SUB
#VAR
V.CYC.SysRetCenterX
#ENDVAR
L CYCLE [NAME = "SysCalcCircle.ecy" @P60 = 0 , @P50 = 6 @P51 = 5 @P61 = 1 @P52 = 4 @P62 = 0 @P56 = 5 @P66 = -1]
#MSG ["%f %f", V.CYC.SysRetCenterX, V.CYC.SysRetRadius]
M17
%MAIN
#VAR
V.CYC.SysRetRadius
#ENDVAR
LL SUB
#MSG ["main %f", V.CYC.SysRetRadius]
M30
