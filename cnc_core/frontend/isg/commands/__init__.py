"""The `#` commands of ISG, a file for each group."""
