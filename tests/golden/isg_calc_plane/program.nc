#VAR
V.CYC.SysRetNormalX
V.CYC.SysRetNormalY
V.CYC.SysRetNormalZ
V.CYC.SysRetSupVectorX
V.CYC.SysRetSupVectorY
V.CYC.SysRetSupVectorZ
#ENDVAR
L CYCLE [NAME=SysCalcPlane.ecy \
@P50=1 @P60=0 @P70=0 \
@P51=0 @P61=1 @P71=0 \
@P52=1 @P62=1 @P72=0 \
]
#FILE NAME [MSG="SysCalcPlaneResult.txt"]
#MSG SAVE EXCLUSIVE["Normal X = %f",V.CYC.SysRetNormalX]
#MSG SAVE EXCLUSIVE["Normal Y = %f",V.CYC.SysRetNormalY]
#MSG SAVE EXCLUSIVE["Normal Z = %f",V.CYC.SysRetNormalZ]
#MSG SAVE EXCLUSIVE["Point X = %f",V.CYC.SysRetSupVectorX]
#MSG SAVE EXCLUSIVE["Point Y = %f",V.CYC.SysRetSupVectorY]
#MSG SAVE EXCLUSIVE["Point Z = %f",V.CYC.SysRetSupVectorZ]
M30
