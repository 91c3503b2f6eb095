"""Examination of recorded data before use: times, units, axes, clocks, noise, and a suggested scenario."""
