"""Attitude, velocity and position by functional iteration over windows of samples, the reference for comparisons.

Rate and specific force over a window are the polynomials whose integrals over its samples are the increments. The
unknowns are represented by their values at Chebyshev points. The integral equations

    q = 1 + ½ ∫ q ∘ ω dt                                     body, relative to its axes at the window's start
    v = v₀ + ∫ (C_wb f + g − (2ω_ie + ω_ew) × v) dt           likewise position and the rotation of the navigation frame

are iterated (Picard) at these points to rounding, with integrals by the Chebyshev integration matrix. The remaining
error is that of the polynomials. Quaternion: Wu, Y., "RodFIter: attitude reconstruction from inertial measurement by
functional iteration", IEEE Trans. AES 54 (2018) 2131, and Wu, Y., Yan, G., "Attitude reconstruction from inertial
measurements: QuatFIter and its comparison with RodFIter", IEEE Trans. AES 55 (2019) 3629; with velocity and position:
Wu, Y., "iNavFIter: next-generation inertial navigation computation based on functional iteration", IEEE Trans. AES 56
(2020) 2061.

A window has eight samples, and the solution has a row at the end of every sample. Remaining samples at the end are
navigated with a polynomial through the last eight.
"""

from __future__ import annotations

from collections.abc import Callable

from sinssim.errors import InputError
from sinssim.formatting import listed
from sinssim.frames import FRAME_REGISTRY, frames_that
from sinssim.strapdown.frames.navigation_problem import Problem
from sinssim.strapdown.iteration import functional_inertial, functional_level

_ENGINES = {
    "level": functional_level.solve,
    "azimuth": functional_level.solve,
    "inertial": functional_inertial.solve,
}
"""Engines by file of the frame."""


def engine(frame: str) -> Callable[[Problem, str], None]:
    """Return the engine for a frame.

    Args:
        frame: one of `sinssim.FRAMES`.

    Raises:
        InputError: there is no engine for this frame.
    """
    file = FRAME_REGISTRY[frame].file
    if file not in _ENGINES:
        raise InputError(
            f"functional-iteration has its own engine for each frame, but none for {frame}; it can be used in the "
            "frames"
            f" {listed(frames_that(lambda entry: entry.file in _ENGINES))}. All other algorithms navigate in {frame}."
        )
    return _ENGINES[file]
