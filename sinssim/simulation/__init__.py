"""The stages of a run: truth, sensed, navigated, aided; each is frozen and knows those before it."""
