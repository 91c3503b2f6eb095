"""The media: each renders any exhibit on the console, as HTML, in Rerun, as a figure or in files."""
