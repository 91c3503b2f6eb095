"""The beginning of a motion is a motion."""

from __future__ import annotations

from sinssim.experiments.studies.study_schema import StudyMotion, first_seconds, trajectory_of


def test_beginning():
    cone = {"type": "coning", "half_angle_deg": 2.0, "frequency_hz": 3.0, "duration_s": 5.0}
    trajectory = trajectory_of(StudyMotion.model_validate({"motion": cone, "duration_s": 4.0}))
    assert (trajectory.start, trajectory.end) == (0.0, 4.0)
    imu = trajectory.increments(100.0)
    assert len(imu) == 400
    assert imu.time[-1] == 4.0
    assert len(first_seconds(imu, 1.0)) == 100
    assert len(first_seconds(imu, 1.005)) == 100
