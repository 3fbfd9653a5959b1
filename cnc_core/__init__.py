"""The CNC: front ends, geometry, engine, command line."""
