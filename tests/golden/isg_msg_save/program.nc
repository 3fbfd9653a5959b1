#FILE NAME [MSG="a/log.txt"]
#MSG SAVE EXCLUSIVE ["one %f", 1]
#FILE NAME [MSG="../x"]
#FILE NAME [MSG="/etc/x"]
