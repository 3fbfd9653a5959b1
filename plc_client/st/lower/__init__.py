"""From the syntax tree to C: every expression gets its type on the way."""
