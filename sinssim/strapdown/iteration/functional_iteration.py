"""Attitude, velocity and position by functional iteration over windows of samples: the reference of the comparison.

Rate and specific force over a window are the polynomials whose integrals over its samples are the increments. The
unknowns are carried by their values at Chebyshev points; the integral equations

    q = 1 + ½ ∫ q ∘ ω dt                                     body, relative to its axes at the window's start
    v = v₀ + ∫ (C_wb f + g − (2ω_ie + ω_ew) × v) dt           and position, and the turn of the navigation frame

are iterated (Picard) at these points until nothing changes beyond rounding, with integrals by the Chebyshev
integration matrix. What is left is how well the polynomials describe the motion. Quaternion: Wu, Y., "RodFIter:
attitude reconstruction from inertial measurement by functional iteration", IEEE Trans. AES 54 (2018) 2131, and Wu, Y.,
Yan, G., "Attitude reconstruction from inertial measurements: QuatFIter and its comparison with RodFIter", IEEE Trans.
AES 55 (2019) 3629; with velocity and position: Wu, Y., "iNavFIter: next-generation inertial navigation computation
based on functional iteration", IEEE Trans. AES 56 (2020) 2061.

A window takes eight samples, and the solution has a row at the end of every sample. Samples left over at the end are
navigated with a polynomial through the last eight.
"""

from __future__ import annotations

from collections.abc import Callable

from sinssim.errors import InputError
from sinssim.frames import FRAME_REGISTRY, frames_that, listed
from sinssim.strapdown.frames.problem import Problem
from sinssim.strapdown.iteration import functional_inertial, functional_level

_ENGINES = {
    "level": functional_level.solve,
    "azimuth": functional_level.solve,
    "inertial": functional_inertial.solve,
}
"""Engines by the file of the frame."""


def engine(frame: str) -> Callable[[Problem, str], None]:
    """Return the engine for a frame.

    Args:
        frame: one of `sinssim.FRAMES`.

    Returns:
        A function of a problem and the frame.

    Raises:
        InputError: it has none for this frame.
    """
    file = FRAME_REGISTRY[frame].file
    if file not in _ENGINES:
        raise InputError(
            f"functional-iteration brings an engine of its own for each frame, and has none for {frame}; it has one for"
            f" {listed(frames_that(lambda entry: entry.file in _ENGINES))}. Any other algorithm navigates in {frame}."
        )
    return _ENGINES[file]
