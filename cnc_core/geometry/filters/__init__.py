"""Filters that change or drop rows of short motions."""
