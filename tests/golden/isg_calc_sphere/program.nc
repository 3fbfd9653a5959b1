#VAR
V.CYC.SysRetCenterX
V.CYC.SysRetCenterY
V.CYC.SysRetCenterZ
V.CYC.SysRetRadius
V.CYC.SysRetVariance
#ENDVAR
L CYCLE [NAME=SysCalcSphere.ecy @P50=1 @P60=0 @P70=0 \
@P51=-1 @P61=0 @P71=0 \
@P52=0 @P62=1 @P72=0 \
@P53=0 @P63=-1 @P73=0 \
@P54=0 @P64=0 @P74=1]
#FILE NAME [MSG="SysCalcSphereResult.txt"]
#MSG SAVE EXCLUSIVE["Center X = %f",V.CYC.SysRetCenterX]
#MSG SAVE EXCLUSIVE["Center Y = %f",V.CYC.SysRetCenterY]
#MSG SAVE EXCLUSIVE["Center Z = %f",V.CYC.SysRetCenterZ]
#MSG SAVE EXCLUSIVE["Radius = %f",V.CYC.SysRetRadius]
#MSG SAVE EXCLUSIVE["Variance = %f",V.CYC.SysRetVariance]
M30
