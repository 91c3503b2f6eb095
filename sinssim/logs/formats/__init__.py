"""Formats of recorded sensors, solutions and exports: reader and writer of a program in one file; the registries."""
