"""Formats of robots and of data sets for them: MCAP, EuRoC, TUM."""
