"""Codes of quality without factors: what a receiver calls no fix is refused, float fixes of centimetres are named."""

from __future__ import annotations

import numpy as np

from sinssim.logs.formats import nmea_ubx, novatel
from sinssim.logs.log_settings import LogGnss
from sinssim.logs.recorded_log import gnss_readings, quality_factor, quality_words
from sinssim.logs.recorded_streams import FixStream


def fixes(quality: list[int], words: dict[int, str], sigma: float = 0.02) -> FixStream:
    count = len(quality)
    zero = np.zeros(count)
    return FixStream(
        np.arange(float(count)), zero + 0.7, zero + 0.1, zero, "ellipsoid", np.full((count, 3), sigma),
        quality=np.array(quality), quality_words=words,
    )  # fmt: skip


PLAIN = LogGnss(file="x.pos", use=("position",))


def test_no_fix_is_no_fix() -> None:
    """NMEA's code 0 and NovAtel's NONE; RTKLIB's file holds fixes only."""
    words = nmea_ubx.NMEA_QUALITY
    stream = fixes([4, 0, 5, 1], words)
    np.testing.assert_array_equal(quality_factor(stream, PLAIN), [1.0, np.nan, 1.0, 1.0])
    (readings,) = gnss_readings(stream, PLAIN, ())
    np.testing.assert_array_equal(readings.measurements.time, [0.0, 2.0, 3.0])
    assert "1 of quality 0 (no fix), refused" in next(quality_words(stream, PLAIN))
    assert novatel.WORDS[0] == "none"
    given = PLAIN.model_copy(update={"quality_factors": {"4": 1.0, "0": 5.0}})
    np.testing.assert_array_equal(quality_factor(stream, given), [1.0, 5.0, np.nan, np.nan])


def test_float_fixes_that_claim_centimetres_are_named() -> None:
    words = {1: "fixed", 2: "float", 5: "single"}
    said = list(quality_words(fixes([1, 2, 5], words), PLAIN))
    assert "Float fixes state 0.02 m" in said[1]
    assert '"2" = 10.0' in said[1]
    assert len(list(quality_words(fixes([1, 2, 5], words, sigma=0.5), PLAIN))) == 1
    assert len(list(quality_words(fixes([1, 5], words), PLAIN))) == 1
    given = PLAIN.model_copy(update={"quality_factors": {"1": 1.0, "2": 20.0}})
    assert len(list(quality_words(fixes([1, 2], words), given))) == 1
