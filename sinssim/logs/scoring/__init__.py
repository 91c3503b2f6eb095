"""Errors of solutions that other programs computed from the exported readings of a run."""
