"""The clocks of recorded files: stamps, offset, drift."""
