"""Types with their bytes, names with their meaning, constants with their values."""
