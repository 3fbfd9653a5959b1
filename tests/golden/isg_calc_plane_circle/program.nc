#VAR
V.CYC.SysRetCenterX
V.CYC.SysRetCenterY
V.CYC.SysRetCenterZ
V.CYC.SysRetRadius
V.CYC.SysRetNormalX
V.CYC.SysRetNormalY
V.CYC.SysRetNormalZ
V.CYC.SysRetRadVariance
#ENDVAR
L CYCLE [NAME=SysCalcPlaneCircle.ecy @P50=1 @P60=0 @P70=1 \
@P51=0 @P61=1 @P71=1 \
@P52=-1 @P62=0 @P72=1 \
@P53=0 @P63=-1 @P73=1]
#FILE NAME [MSG="SysCalcPlaneCircleResult.txt"]
#MSG SAVE EXCLUSIVE["Radius = %f",V.CYC.SysRetRadius]
#MSG SAVE EXCLUSIVE["Center X = %f",V.CYC.SysRetCenterX]
#MSG SAVE EXCLUSIVE["Center Y = %f",V.CYC.SysRetCenterY]
#MSG SAVE EXCLUSIVE["Center Z = %f",V.CYC.SysRetCenterZ]
#MSG SAVE EXCLUSIVE["Normal X = %f",V.CYC.SysRetNormalX]
#MSG SAVE EXCLUSIVE["Normal Y = %f",V.CYC.SysRetNormalY]
#MSG SAVE EXCLUSIVE["Normal Z = %f",V.CYC.SysRetNormalZ]
#MSG SAVE EXCLUSIVE["Variance = %f",V.CYC.SysRetRadVariance]
M30
