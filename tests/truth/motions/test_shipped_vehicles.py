"""The shipped scenarios with [drive] and [voyage]."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim import load_scenario
from sinssim.experiments.run.parts.phases import phases_of
from sinssim.scenario.true_motion import fly


def test_delivery_drive_has_its_tunnel_on_the_main_road() -> None:
    plan = load_scenario("delivery_drive")
    motion = fly(plan)
    assert plan.aiding is not None
    assert plan.aiding.gnss is not None
    ((begin, end),) = plan.aiding.gnss.outages_s
    speed = np.linalg.norm(motion.state(np.linspace(begin, end, 50)).velocity_ned, axis=1)
    assert speed == pytest.approx(np.full(50, 19.0), abs=0.5)
    assert [phase.name for phase in phases_of(motion.events, driven=True)] == ["standstill", "under way"] * 3 + [
        "standstill"
    ]


def test_sea_voyage_is_at_anchor_while_it_aligns_itself() -> None:
    """The ship moves with the waves only, below the 2 m/s of the fit; the sea itself is that of the first minutes."""
    plan = load_scenario("sea_voyage")
    assert plan.voyage is not None
    assert plan.navigation.alignment is not None
    anchored = plan.voyage.model_copy(update={"legs": plan.voyage.legs[:1]})
    motion = fly(plan.model_copy(update={"voyage": anchored}))
    until = plan.navigation.alignment.duration_s
    assert until <= motion.end - motion.start
    speed = np.linalg.norm(motion.state(np.arange(0.0, until, 1.0)).velocity_ned, axis=1)
    assert 0.3 < speed.max() < 2.0
