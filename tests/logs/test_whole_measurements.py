"""What the filter gets of recorded fixes and readings, number by number, and the sentences on their quality."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sinssim.errors import InputError
from sinssim.logs.log_settings import LogGnss, LogOther
from sinssim.logs.recorded_log import gnss_readings, other_readings, quality_factor, quality_words, withheld
from sinssim.logs.recorded_streams import FixStream, OtherStream

NAN = float("nan")
COVARIANCE = np.array([[0.25, 0.0625, -0.1875], [0.0625, 0.5625, 0.28125], [-0.1875, 0.28125, 1.0]])
"""σ of 0.5, 0.75 and 1 m; correlations of 1/6, −3/8 and 3/8."""
FIXES = FixStream(
    time=np.array([10.5, 11.25, 12.75, 14.5, 15.25]),
    latitude=np.array([0.5, 0.51, 0.52, 0.53, 0.54]),
    longitude=np.array([-1.5, -1.51, -1.52, -1.53, -1.54]),
    height=np.array([100.0, 110.0, NAN, 130.0, 140.0]),
    position_sigma=np.array([[0.5, 0.75, 1.0], [0.25, 0.375, 2.5], [1.0] * 3, [0.125, 3.0, 4.0], [5.0, 6.0, 7.0]]),
    velocity_ned=np.array([[1.5, -2.5, 3.5], [4.5, 5.5, NAN], [7.5, -8.5, 9.5], [NAN, 1.0, 2.0], [-1.5, 2.5, -3.5]]),
    velocity_sigma=np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9], [1.0] * 3, [0.02, 0.03, 0.25]]),
    quality=np.array([4, 5, 4, 1, 4]),
    quality_words={1: "single", 4: "fixed", 5: "float"},
    covariance=np.array([COVARIANCE, np.full((3, 3), NAN), COVARIANCE, COVARIANCE, 4.0 * COVARIANCE]),
)


def gnss(**keys: object) -> LogGnss:
    return LogGnss.model_validate({"file": "x.pos", "lever_arm_m": [0.5, -0.25, -1.5], **keys})


def test_positions_and_velocities() -> None:
    """σ times a factor, not below a least one, times the factor of the quality; later arrival; velocities are delayed.

    The third fix has no height, the fourth is refused and has no northern velocity; a climb that is not known is 0 with
    a σ of 100 m/s, which no factor changes. The fix at 15.25 s is in the outage, that at 11.25 s at its beginning; the
    velocities are 0.5 s older.
    """
    section = gnss(
        sigma_factor=2.0, velocity_sigma_factor=3.0, least_sigma_m=1.25, least_velocity_sigma_mps=0.45, latency_s=0.125,
        velocity_delay_s=0.5, quality_factors={"4": 1.0, "5": 10.0},
    )  # fmt: skip
    place, speed = gnss_readings(FIXES, section, ((11.25, 12.0), (14.75, 20.0)))
    m = place.measurements
    assert (m.kind, m.name, m.lever_arm.tolist()) == ("gnss-position", "gnss-position", [0.5, -0.25, -1.5])
    np.testing.assert_allclose(place.time, [10.5, 11.25, 15.25])
    np.testing.assert_allclose(m.time, [10.5, 11.25])
    np.testing.assert_allclose(m.arrival, [10.625, 11.375])
    np.testing.assert_allclose(m.value, [[0.5, -1.5, 100.0], [0.51, -1.51, 110.0]])
    np.testing.assert_allclose(m.sigma, [[1.25, 1.5, 2.0], [12.5, 12.5, 50.0]])
    of_one = [[1.0, 1.0 / 6.0, -0.375], [1.0 / 6.0, 1.0, 0.375], [-0.375, 0.375, 1.0]]
    assert m.correlation is not None
    np.testing.assert_allclose(m.correlation, [of_one, np.eye(3)], rtol=1e-12)
    m = speed.measurements
    assert (m.kind, m.name, m.correlation) == ("gnss-velocity", "gnss-velocity", None)
    np.testing.assert_allclose(speed.time, [10.0, 10.75, 12.25, 14.75])
    np.testing.assert_allclose(m.time, [10.0, 10.75, 12.25, 14.75])
    np.testing.assert_allclose(m.arrival, [10.625, 11.375, 12.875, 15.375])
    np.testing.assert_allclose(m.value, [[1.5, -2.5, 3.5], [4.5, 5.5, 0.0], [7.5, -8.5, 9.5], [-1.5, 2.5, -3.5]])
    np.testing.assert_allclose(
        m.sigma, [[0.45, 0.6, 0.9], [12.0, 15.0, 100.0], [2.1, 2.4, 2.7], [0.45, 0.45, 0.75]], rtol=1e-12
    )


def test_stated_sigmas_replace_those_of_the_file() -> None:
    section = gnss(position_sigma_m=[2.0, 3.0, 4.0], velocity_sigma_mps=[0.25, 0.5, 0.75], quality_factors={"1": 7.0})
    place, speed = gnss_readings(replace(FIXES, velocity_ned=np.abs(FIXES.velocity_ned)), section, ())
    np.testing.assert_allclose(place.measurements.sigma, [[14.0, 21.0, 28.0]])
    assert place.measurements.correlation is None
    assert len(speed.measurements) == 0
    assert [one.measurements.kind for one in gnss_readings(FIXES, gnss(use=["velocity"]), ())] == ["gnss-velocity"]
    still = replace(FIXES, velocity_ned=None)
    assert [one.measurements.kind for one in gnss_readings(still, gnss(), ())] == ["gnss-position"]
    with pytest.raises(InputError, match="has no velocities"):
        gnss_readings(still, gnss(use=["velocity"]), ())
    with pytest.raises(InputError, match=r"x\.pos gives no 1σ for this.*position_sigma_m = \[2, 2, 4\]"):
        gnss_readings(replace(FIXES, position_sigma=None), gnss(), ())
    with pytest.raises(InputError, match=r"velocity_sigma_mps = \[0\.1, 0\.1, 0\.2\]"):
        gnss_readings(replace(FIXES, velocity_sigma=None), gnss(), ())


def test_correlations_that_cannot_be() -> None:
    """Of 1 they are taken as 0.999, which is then not sound; a negative definite matrix and one without σ are none."""
    whole = np.array([
        [[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]],
        [[0.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.5, 1.0]],
        [[4.0, 3.0, 0.0], [3.0, 9.0, 0.0], [0.0, 0.0, 16.0]],
    ])  # fmt: skip
    (place,) = gnss_readings(
        FixStream(*np.arange(16.0).reshape(4, 4) / 100.0, position_sigma=np.ones((4, 3)), covariance=whole), gnss(), ()
    )
    assert place.measurements.correlation is not None
    half = [[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(place.measurements.correlation, [half, np.eye(3), np.eye(3), half], rtol=1e-12)


def test_an_outage_begins_after_its_beginning_and_has_its_end() -> None:
    time = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    assert withheld(time, ((2.0, 4.0), (5.5, 9.0))).tolist() == [False, False, True, True, False, True]


def test_sentences_on_quality() -> None:
    """The float fix states 0.25 m north and 0.375 m east; with 0.06 and 0.12 m the median of both is 0.09 m."""
    (said,) = quality_words(FIXES, gnss())
    assert said == "The quality of the fixes: 1 of quality 1 (single); 3 of quality 4 (fixed); 1 of quality 5 (float)."
    assert FIXES.position_sigma is not None
    small = FIXES.position_sigma.copy()
    small[1] = 0.06, 0.12, 9.0
    (_, doubt) = quality_words(replace(FIXES, position_sigma=small), gnss())
    assert doubt == (
        "Float fixes state 0.09 m (1σ, median), but float ambiguities may be wrong by decimetres. The filter uses the "
        'stated 1σ; quality_factors = { …, "5" = 10.0 } would increase it.'
    )
    (said,) = quality_words(FIXES, gnss(quality_factors={"4": 1.0, "5": 2.5}))
    assert said == (
        "The quality of the fixes: 1 of quality 1 (single), refused; 3 of quality 4 (fixed); 1 of quality 5 (float), σ "
        "times 2.5."
    )
    assert quality_factor(FIXES, gnss(quality_factors={"4": 1.0, "5": 2.5})).tolist()[:3] == [1.0, 2.5, 1.0]
    (said,) = quality_words(replace(FIXES, quality_words={1: "no fix"}), gnss())
    assert said == "The quality of the fixes: 1 of quality 1 (no fix), refused; 3 of quality 4; 1 of quality 5."
    with pytest.raises(InputError, match=r"x\.pos has no codes of quality, but quality_factors are given"):
        quality_factor(replace(FIXES, quality=None), gnss(quality_factors={"4": 1.0}))


def test_readings_of_another_sensor() -> None:
    stream = OtherStream(
        "baro", "baro-height", np.array([1.5, 2.5, 3.5, 4.5]), np.array([[100.0], [NAN], [120.0], [130.0]]),
        np.array([[0.5], [0.75], [NAN], [1.25]]),
    )  # fmt: skip
    section = LogOther.model_validate(
        {"file": "b.csv", "name": "my-baro", "kind": "baro-height", "reading": {"column": "h", "unit": "m"},
         "sigma": {"value": 1.0, "unit": "m"}, "lever_arm_m": [0.5, -0.25, -1.5]}
    )  # fmt: skip
    found = other_readings(stream, section)
    m = found.measurements
    assert (m.kind, m.name, m.lever_arm.tolist()) == ("baro-height", "my-baro", [0.5, -0.25, -1.5])
    for values in (found.time, m.time, m.arrival):
        assert values.tolist() == [1.5, 4.5]
    assert m.value.tolist() == [[100.0], [130.0]]
    assert m.sigma.tolist() == [[0.5], [1.25]]
