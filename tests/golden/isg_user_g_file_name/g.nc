X[@P1] Y[@P2] Z[@P3]
