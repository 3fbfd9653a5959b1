"""Curves and solids of numbers alone: no rows, no stages."""
