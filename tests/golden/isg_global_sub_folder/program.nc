G00
L subs/a.nc
