; a named mode: defaults for what is not named; no mode: only what is named
#CONTOUR MODE ON [DEV PATH_DEV=0.1]
#CONTOUR MODE [DIST]
#CONTOUR MODE [PRE_DIST=4]
#CONTOUR MODE [DEV]
#CONTOUR MODE OFF
