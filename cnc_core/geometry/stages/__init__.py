"""Stages that a row of a program passes on its way to the engine."""
