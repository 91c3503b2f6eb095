"""One file for each format that runs are written in, and the registry of them."""
