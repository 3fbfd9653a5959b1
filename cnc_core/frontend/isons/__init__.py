"""Front end of the IsoNs dialect (``front_end.IsonsFrontEnd``; the cell file
reads ``parameters`` without it).
"""
