"""The PLC side."""
