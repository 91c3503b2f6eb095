"""What the tests of inspections share."""

from __future__ import annotations

import pytest

from sinssim.analyses.inspection import suggestion_trial


@pytest.fixture(autouse=True)
def one_pass_of_two_outages(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Try suggested scenarios over 48 s once: seven minutes and four passes are most of an inspection's time.

    `test_trial.py` is about the trials, and sets its own; the table of public logs has those of a user.
    """
    if not request.node.get_closest_marker("slow") and request.path.name != "test_public_logs.py":
        monkeypatch.setattr(suggestion_trial, "_LONGEST_S", 48.0)
        monkeypatch.setattr(suggestion_trial, "_PASSES", 1)
