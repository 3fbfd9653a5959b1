"""Dialogs, forms and colours that an IsoNs program shows to the operator."""
