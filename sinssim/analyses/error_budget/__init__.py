"""Covariance budget: navigation errors of a scenario by source, without random numbers."""
