"""Predictions from a flight plan: heights over the way, limits of the aircraft."""
