"""The strapdown engine: navigation from increments, by interchangeable attitude algorithms."""

from __future__ import annotations

from sinssim.names import ALGORITHMS, FRAMES
from sinssim.strapdown.navigate import navigate

__all__ = ["ALGORITHMS", "FRAMES", "navigate"]
