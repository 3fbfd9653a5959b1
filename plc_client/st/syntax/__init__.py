"""From the text of a unit to its syntax tree."""
