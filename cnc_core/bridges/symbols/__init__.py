"""The symbols of HLI and PLC, once for all bridges: paths, types, bytes."""
