"""Recorded sensors and solutions: what files hold, how they are read, and how they are written for other programs."""
