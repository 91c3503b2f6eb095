"""Judges recorded data before anybody relies on them: times, units, axes, clocks, noise; `sinssim inspect`."""
