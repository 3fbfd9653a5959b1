L b.nc
