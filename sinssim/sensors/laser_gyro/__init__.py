"""The physics of laser gyros: ring, lock-in and dither, null shift by gas flow."""

from sinssim.sensors.laser_gyro.ring import LaserGyro

__all__ = ["LaserGyro"]
