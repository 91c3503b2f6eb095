"""Says when an aided solution is less accurate than an inertial one, which it should not be."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sinssim.formatting import number_text

if TYPE_CHECKING:
    from sinssim.data import Array
    from sinssim.simulation.aided.truth_comparison import Aided
    from sinssim.strapdown.nav_error import NavError

_BEYOND = 2.0
"""Ratio of the rms error to the rms of the filter's own 1σ beyond which the filter is wrong, not the draw unlucky."""


_ROWS = 2000
"""Approximate number of rows of an inertial solution that are compared."""


def horizontal_of(errors: Mapping[str, NavError]) -> dict[str, tuple[Array, Array]]:
    """Return time and horizontal error of solutions at about `_ROWS` rows.

    Returns:
        s and m, by name.
    """
    some = {name: slice(None, None, max(len(error.time) // _ROWS, 1)) for name, error in errors.items()}
    return {name: (error.time[some[name]].copy(), error.horizontal[some[name]]) for name, error in errors.items()}


def worse_than_inertial(aided: Aided, inertial: Mapping[str, tuple[Array, Array]]) -> Iterator[str]:
    """Report inertial solutions with a smaller horizontal error than the aided one over the time of the filter.

    Args:
        inertial: time and horizontal error of the inertial solutions by name, from `horizontal_of`.

    Yields:
        Whole sentences, one for each; none where the errors are not known.
    """
    time = aided.estimate.time
    if len(time) < 2:
        return
    own = np.concatenate([error.horizontal for error in aided.error_blocks()])
    for name, (instant, horizontal) in inertial.items():
        squares = horizontal[(instant >= time[0]) & (instant <= time[-1])] ** 2
        if not np.isfinite(own).any() or not np.isfinite(squares).any():
            continue
        rms, other = float(np.sqrt(np.nanmean(own**2))), float(np.sqrt(np.nanmean(squares)))
        if rms <= other:
            continue
        sigma = float(np.sqrt(np.mean(np.sum(aided.estimate.sigma[:, :2] ** 2, axis=1))))
        why = (
            "The error is beyond what the filter states: its model is wrong."
            if rms > _BEYOND * sigma
            else "The error is within what the filter states, so that this may be the chance of one run; `sinssim "
            "ensemble` and `sinssim budget` compare both over all runs."
        )
        yield (
            f"From {time[0]:.0f} s to {time[-1]:.0f} s the aided solution is worse than {name}: its horizontal error "
            f"is {number_text(rms)} m (rms), that of {name} {number_text(other)} m. The filter's own 1σ is "
            f"{number_text(sigma)} m. {why}"
        )
