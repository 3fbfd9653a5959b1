; R alone stores; it holds until another R, and I J K have precedence in their block
R=5
G02 X10 F100
G03 X20
G02 X30 I5
X40
R-5 G03 X50
