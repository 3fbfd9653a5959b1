"""The IsoNs language: formulas, macros, words."""
