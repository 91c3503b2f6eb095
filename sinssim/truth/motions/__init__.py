"""Motions in closed form: parked, coning, great circle, turntable; vibration and the rotation of the block."""
