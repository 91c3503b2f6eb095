"""Calibration on a turntable: errors of gyros and accelerometers from separate tests or from navigation errors."""
