"""Finished runs, read from their directories: lists and comparisons."""
