"""Recorded and planned motion as a source of truth: samples or waypoints become a smooth exact curve."""
