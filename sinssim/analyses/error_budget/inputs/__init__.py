"""The sources, and their effect on the measurements and on the navigation errors in a step."""
