"""What the dialects share: reading the file, tokens, expressions, the C scanner."""
