L none.nc
