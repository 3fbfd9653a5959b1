"""What tests share: a CNC in the test's process, programs of each dialect,
checks of samples, real processes.
"""
