"""OPC UA: the model for CNC systems (OPC 40502) and the symbols beside it."""
