"""One file for each attitude algorithm: four functions, named in `sinssim/algorithm_registry.py`."""
