V.P.T="a"+"b"
G00
$IF V.P.T == "ab"
X1
$ENDIF
$IF V.P.T != "ab"
X2
$ENDIF
