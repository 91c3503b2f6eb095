"""What the sources are, and what they do to the readings and to the navigation errors in a step."""
