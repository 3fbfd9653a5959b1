"""Geometry stages between the front end and the kinematics."""
