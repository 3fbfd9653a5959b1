G00
L CYCLE [NAME=c.nc \
 @P1=5 \
 ]
