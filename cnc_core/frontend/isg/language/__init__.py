"""The ISG language: words, expressions, texts, tables of G codes."""
