"""Common base of the dialects: file, tokens, expressions, the C scanner."""
