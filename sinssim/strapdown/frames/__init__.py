"""The navigation frames, each with one step, and the vertical channel; named in `sinssim/frame_registry.py`."""
