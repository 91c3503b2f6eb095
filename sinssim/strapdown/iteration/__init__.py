"""Functional iteration: the reference of the comparison of algorithms."""
