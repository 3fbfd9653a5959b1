#VAR
V.CYC.SysRetDirVectorX
V.CYC.SysRetDirVectorY
V.CYC.SysRetDirVectorZ
V.CYC.SysRetSupVectorX
V.CYC.SysRetSupVectorY
V.CYC.SysRetSupVectorZ
V.CYC.SysRetVariance
#ENDVAR
L CYCLE [NAME=SysCalcLine.ecy @P50=0 @P60=0 @P70=0 \
@P51=1 @P61=0 @P71=0 \
@P52=2 @P62=0 @P72=0]
#FILE NAME [MSG="SysCalcLineResult.txt"]
#MSG SAVE EXCLUSIVE["Direction X = %f",V.CYC.SysRetDirVector[0]]
#MSG SAVE EXCLUSIVE["Direction Y = %f",V.CYC.SysRetDirVector[1]]
#MSG SAVE EXCLUSIVE["Direction Z = %f",V.CYC.SysRetDirVector[2]]
#MSG SAVE EXCLUSIVE["Point on Line X = %f",V.CYC.SysRetSupVector[0]]
#MSG SAVE EXCLUSIVE["Point on Line Y = %f",V.CYC.SysRetSupVector[1]]
#MSG SAVE EXCLUSIVE["Point on Line Z = %f",V.CYC.SysRetSupVector[2]]
#MSG SAVE EXCLUSIVE["Variance = %f",V.CYC.SysRetVariance]
