"""One file for each format of recorded sensors and solutions, and the registry of formats."""
