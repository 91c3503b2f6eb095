"""Laser gyros by their physics: the ring, the lock-in and its dither, the null shift by gas flow."""

from sinssim.sensors.laser_gyro.ring import LaserGyro

__all__ = ["LaserGyro"]
