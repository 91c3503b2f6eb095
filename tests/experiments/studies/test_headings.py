"""Heading through full turns: a table whose turns are known, in four forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sinssim import rotation
from sinssim.experiments.studies import study_schema
from sinssim.experiments.studies.attitude_claims import FORMS, compare_headings, headings
from sinssim.experiments.studies.study_schema import StudyMotion

TABLE = {
    "type": "rotation-table", "latitude_deg": 50.0, "roll_deg": 20.0, "pitch_deg": 10.0, "heading_deg": 350.0,
    "steps": [{"type": "turn", "axis": [0.0, 0.0, 1.0], "angle_deg": 1800.0, "rate_deg_s": 300.0}],
}  # fmt: skip


@pytest.fixture(scope="module")
def table():
    trajectory = study_schema.trajectory_of(StudyMotion.model_validate({"motion": TABLE}))
    return trajectory, trajectory.increments(200.0)


def test_five_turns_in_four_forms(table):
    trajectory, ideal = table
    found = {h.form: h for h in compare_headings("p", "table", trajectory, ideal, {200.0: 1})}
    assert tuple(found) == FORMS
    for heading in found.values():
        assert heading.turns == pytest.approx(5.0, abs=1e-9)
    assert [found[form].jumps for form in FORMS] == [0, 10, 5, 0]
    assert found["integrated"].max_error_arcsec < 0.01
    assert found["integrated"].heading[-1] == pytest.approx(math.radians(350.0 + 1800.0), abs=1e-7)
    assert found[FORMS[3]].max_error_arcsec < 1e-6
    for form in FORMS[1:3]:  # both end at −10°, which is 1800° + 350° modulo 360°
        assert found[form].heading[-1] == pytest.approx(math.radians(-10.0), abs=1e-9)
        assert found[form].final_error_arcsec == pytest.approx(0.0, abs=1e-6)
    assert found[FORMS[1]].max_error_arcsec == pytest.approx(180.0 * 3600.0, rel=1e-9)  # of one argument
    assert 0.4 < found[FORMS[1]].wrong < 0.6
    assert found[FORMS[2]].max_error_arcsec < 1e-6  # of two arguments: never wrong
    assert found[FORMS[2]].wrong == 0.0
    assert np.all(np.abs(found[FORMS[1]].heading) <= 0.5 * np.pi)
    assert np.all(np.abs(found[FORMS[2]].heading) <= np.pi)


def test_arctangents_are_those_of_the_true_heading(table):
    trajectory, ideal = table
    true = rotation.euler_from_quaternion(trajectory.state(ideal.time).q_nb)[2]
    found = headings(trajectory, ideal, np.unwrap(true))
    assert found[FORMS[2]] == pytest.approx(np.mod(true + np.pi, 2.0 * np.pi) - np.pi, abs=1e-9)
    assert np.tan(found[FORMS[1]]) == pytest.approx(np.tan(true), rel=1e-6, abs=1e-9)


def test_unwrapping_needs_a_reading_every_half_turn(table):
    """300 deg/s: half a turn takes 0.6 s, so that 1.67 Hz are needed, a little more where the heading turns faster."""
    trajectory, ideal = table
    found = {(h.rate_hz, h.form): h for h in compare_headings("p", "t", trajectory, ideal, {200.0: 1, 1.25: 160})}
    unwrapped = found[200.0, FORMS[3]]
    assert 1.5 < unwrapped.least_hz < 2.5
    slow = found[1.25, FORMS[3]]
    assert slow.jumps > 0  # turns are lost


def test_a_motion_over_the_vertical_is_not_compared():
    loop = {
        **TABLE,
        "roll_deg": 0.0,
        "steps": [{"type": "turn", "axis": [0.0, 1.0, 0.0], "angle_deg": 360.0, "rate_deg_s": 90.0}],
    }
    trajectory = study_schema.trajectory_of(StudyMotion.model_validate({"motion": loop}))
    assert compare_headings("p", "loop", trajectory, trajectory.increments(50.0), {50.0: 1}) == []
