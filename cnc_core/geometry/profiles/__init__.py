"""Profiles: columns of points, polynomials or B-splines to curves of the axes."""
