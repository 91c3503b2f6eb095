"""One run from end to end: its stages, its parts, and what it has to show."""
