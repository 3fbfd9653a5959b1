"""Basics of IsoNs: texts, parameters, codes, store of variables."""
