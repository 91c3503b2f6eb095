"""Calibration on a turntable: sequences of positions and turns, and their true motion with the table's errors."""
