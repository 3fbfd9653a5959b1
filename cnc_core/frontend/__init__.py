"""Front ends: program text to canonical rows, one package per dialect."""
