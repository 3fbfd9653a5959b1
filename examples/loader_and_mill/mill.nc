; The mill: two parts.  Signal 1: the vice is free.  Signal 2: a part lies in it.
; Signal 4: the loader is out of the way.
N10 V.P.PART = 0
N20 $WHILE V.P.PART < 2
N30   G0 X0 Y0 Z50
N40   #SIGNAL SYN [ID=1 CH=2]
N50   #WAIT SYN [ID=2 CH=2]
N60   M10
N70   #SIGNAL SYN [ID=3 CH=2]
N75   #WAIT SYN [ID=4 CH=2]
N80   G0 X10 Y10
N90   G1 Z-1 F3000
N100  X50 F12000
N110  Y40
N120  X10
N130  Y10
N140  G0 Z50
N150  M11
N160  V.P.PART = V.P.PART + 1
N170 $ENDWHILE
N180 #SIGNAL SYN [ID=1 CH=2]
N190 M30
