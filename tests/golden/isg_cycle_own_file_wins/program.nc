L CYCLE [NAME=SysCalcCircle.ecy @P1=7]
M30
