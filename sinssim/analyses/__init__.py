"""What a system's errors are without many runs: budget, alignment sessions, calibration, noise, inspection of data."""
