"""Curves of a page that one can zoom and read off: their data, the script, and the library uPlot that draws them."""
