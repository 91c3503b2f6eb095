"""Tuning of a filter by the likelihood of its innovations."""
