"""Motion of IsoNs: words to rows."""
