"""True motions that runs share."""

from __future__ import annotations

import weakref

import numpy as np

from sinssim.experiments.ensembles.ensemble_plan import TruthCache
from tests.experiments.ensembles.examples import scenario


def test_a_motion_is_kept_freed_and_computed_again() -> None:
    truths = TruthCache()
    first = truths.of(scenario())
    assert truths.of(scenario(seed=6)) is first
    increments, gone = first.ideal.dtheta.copy(), weakref.ref(first)
    truths.forget()
    del first
    assert gone() is None
    np.testing.assert_array_equal(truths.of(scenario()).ideal.dtheta, increments)
