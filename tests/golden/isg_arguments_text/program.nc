L CYCLE [NAME="c.cyc" @P1="abc" @P2=3]
