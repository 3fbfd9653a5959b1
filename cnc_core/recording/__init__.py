"""Recordings: what happened in a run, written while it lasts, read afterwards.

``docs/recording.md`` states the tables with their units.
"""
