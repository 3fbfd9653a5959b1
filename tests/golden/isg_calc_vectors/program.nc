#VAR
V.CYC.SysRetCenterX
V.CYC.SysRetCenterY
V.CYC.SysRetRadius
V.CYC.SysRetVariance
V.CYC.SysRetCenterZ
V.CYC.SysRetNormalX
V.CYC.SysRetNormalY
V.CYC.SysRetNormalZ
V.CYC.SysRetSupVectorX
V.CYC.SysRetSupVectorY
V.CYC.SysRetSupVectorZ
V.CYC.SysRetDirVectorX
V.CYC.SysRetDirVectorY
V.CYC.SysRetDirVectorZ
V.CYC.SysRetRadVariance
#ENDVAR
; E1
L CYCLE [NAME=SysCalcCircle.ecy @P50=60.02 @P60=-19.99 \
@P51=55.01 @P61=-11.33 \
@P52=45.02 @P62=-11.35 \
@P53=39.99 @P63=-20.02 \
@P54=50.03 @P64=-29.97]
#MSG ["SysRetCenterX %.9f", V.CYC.SysRetCenterX]
#MSG ["SysRetCenterY %.9f", V.CYC.SysRetCenterY]
#MSG ["SysRetRadius %.9f", V.CYC.SysRetRadius]
#MSG ["SysRetVariance %.9f", V.CYC.SysRetVariance]
; E2
L CYCLE [NAME=syscalccircle.ECY @P50=0 @P60=0 \
@P51=2 @P61=2.5 \
@P52=4 @P62=3.4 \
@P53=6 @P63=3.6 \
@P54=8 @P64=2.9]
#MSG ["SysRetCenterX %.9f", V.CYC.SysRetCenterX]
#MSG ["SysRetCenterY %.9f", V.CYC.SysRetCenterY]
#MSG ["SysRetRadius %.9f", V.CYC.SysRetRadius]
#MSG ["SysRetVariance %.9f", V.CYC.SysRetVariance]
; E3
L CYCLE [NAME="SysCalcCircle" @P50=0 @P60=0 \
@P51=10 @P61=0 \
@P52=10 @P62=5]
#MSG ["SysRetCenterX %.9f", V.CYC.SysRetCenterX]
#MSG ["SysRetCenterY %.9f", V.CYC.SysRetCenterY]
#MSG ["SysRetRadius %.9f", V.CYC.SysRetRadius]
#MSG ["SysRetVariance %.9f", V.CYC.SysRetVariance]
L CYCLE [NAME=SysCalcPlane.ecy @P50=0 @P60=0 @P70=1.02 \
@P51=10 @P61=0 @P71=2.97 \
@P52=10 @P62=10 @P72=8.05 \
@P53=0 @P63=10 @P73=5.99 \
@P54=5 @P64=5 @P74=4.48]
#MSG ["SysRetNormalX %.9f", V.CYC.SysRetNormalX]
#MSG ["SysRetNormalY %.9f", V.CYC.SysRetNormalY]
#MSG ["SysRetNormalZ %.9f", V.CYC.SysRetNormalZ]
#MSG ["SysRetSupVectorX %.9f", V.CYC.SysRetSupVectorX]
#MSG ["SysRetSupVectorY %.9f", V.CYC.SysRetSupVectorY]
#MSG ["SysRetSupVectorZ %.9f", V.CYC.SysRetSupVectorZ]
L CYCLE [NAME=SysCalcLine.ecy @P50=0 @P60=0 @P70=0 \
@P51=1 @P61=1.1 @P71=0.9 \
@P52=2 @P62=1.9 @P72=2.1 \
@P53=3 @P63=3.05 @P73=2.95]
#MSG ["SysRetDirVectorX %.9f", V.CYC.SysRetDirVectorX]
#MSG ["SysRetDirVectorY %.9f", V.CYC.SysRetDirVectorY]
#MSG ["SysRetDirVectorZ %.9f", V.CYC.SysRetDirVectorZ]
#MSG ["SysRetSupVectorX %.9f", V.CYC.SysRetSupVectorX]
#MSG ["SysRetSupVectorY %.9f", V.CYC.SysRetSupVectorY]
#MSG ["SysRetSupVectorZ %.9f", V.CYC.SysRetSupVectorZ]
#MSG ["SysRetVariance %.9f", V.CYC.SysRetVariance]
L CYCLE [NAME=SysCalcSphere.ecy @P50=15.01 @P60=2 @P70=3 \
@P51=5 @P61=12.02 @P71=3 \
@P52=-5.01 @P62=2 @P72=3 \
@P53=5 @P63=-7.98 @P73=3 \
@P54=5 @P64=2 @P74=13.01 \
@P55=5 @P65=2 @P75=-6.99]
#MSG ["SysRetCenterX %.9f", V.CYC.SysRetCenterX]
#MSG ["SysRetCenterY %.9f", V.CYC.SysRetCenterY]
#MSG ["SysRetCenterZ %.9f", V.CYC.SysRetCenterZ]
#MSG ["SysRetRadius %.9f", V.CYC.SysRetRadius]
#MSG ["SysRetVariance %.9f", V.CYC.SysRetVariance]
L CYCLE [NAME=SysCalcSphere.ecy @P50=1 @P60=0 @P70=0 \
@P51=0 @P61=1 @P71=0 \
@P52=0 @P62=0 @P72=1 \
@P53=0 @P63=0 @P73=0]
#MSG ["SysRetCenterX %.9f", V.CYC.SysRetCenterX]
#MSG ["SysRetCenterY %.9f", V.CYC.SysRetCenterY]
#MSG ["SysRetCenterZ %.9f", V.CYC.SysRetCenterZ]
#MSG ["SysRetRadius %.9f", V.CYC.SysRetRadius]
#MSG ["SysRetVariance %.9f", V.CYC.SysRetVariance]
L CYCLE [NAME=SysCalcPlaneCircle.ecy @P50=2 @P60=0 @P70=0 \
@P51=0 @P61=2 @P71=0 \
@P52=0 @P62=0 @P72=2]
#MSG ["SysRetCenterX %.9f", V.CYC.SysRetCenterX]
#MSG ["SysRetCenterY %.9f", V.CYC.SysRetCenterY]
#MSG ["SysRetCenterZ %.9f", V.CYC.SysRetCenterZ]
#MSG ["SysRetRadius %.9f", V.CYC.SysRetRadius]
#MSG ["SysRetNormalX %.9f", V.CYC.SysRetNormalX]
#MSG ["SysRetNormalY %.9f", V.CYC.SysRetNormalY]
#MSG ["SysRetNormalZ %.9f", V.CYC.SysRetNormalZ]
#MSG ["SysRetRadVariance %.9f", V.CYC.SysRetRadVariance]
M30
