"""The strapdown engine: navigation from increments with interchangeable attitude algorithms."""

from __future__ import annotations

from sinssim.algorithms import ALGORITHMS
from sinssim.frames import FRAMES
from sinssim.strapdown.navigate import navigate

__all__ = ["ALGORITHMS", "FRAMES", "navigate"]
