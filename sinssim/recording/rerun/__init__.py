"""Rerun recordings, views and the viewer."""
