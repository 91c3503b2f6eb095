"""Predictions of a planned motion: limits of the aircraft, the path."""
