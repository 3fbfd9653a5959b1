"""Cycles that are built in: what they take (``registry``), how a call is
checked (``checking``), what they do.

A cycle is a function from its parameters to a program in the dialect's own
language, which is then executed as a program level of its own: offsets,
coordinate systems, compensation and errors work in it as in any subprogram.
"""
