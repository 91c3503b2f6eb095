"""Initial alignment of the filter, at rest or in motion."""
