G00 X[1(comment)+2]
