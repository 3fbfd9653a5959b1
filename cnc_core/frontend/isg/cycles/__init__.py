"""Built-in cycles: their parameters, the check of a call, their programs.

A cycle is a function from its parameters to a program in the dialect's own
language. The program is executed as a level of its own. Offsets, coordinate
systems, compensation and errors work in it as in any subprogram.
"""
