"""From files to units: one POU, type or variable list each, without comments."""
