"""From the part frame to the axes."""
