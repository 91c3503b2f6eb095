"""Every number, unit and sentence of a report and of the table [imu], from noise terms that are stated by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from sinssim.analyses.allan_deviation import AllanDeviation, confidence_band
from sinssim.analyses.noise_fit import NoiseFit, TermEstimate, spike_of
from sinssim.analyses.noise_imu_table import ImuLine, block_text, imu_block
from sinssim.analyses.noise_report import (
    CHANNELS,
    NAMES,
    SYMBOLS,
    UNITS,
    ChannelNoise,
    LogChannel,
    NoiseReport,
    clock,
    even_increments,
    four_digits,
    noise_report,
    part,
    symbol_text,
    unit_in_name,
    units_of,
)
from sinssim.errors import InputError
from sinssim.logs.imu_samples import Samples

DEG = np.pi / 180.0
DEG_H = DEG / 3600.0
UG = 9.80665e-6
GYRO = {"Q": DEG / 3600.0, "N": DEG / 60.0, "B": DEG_H, "K": DEG_H / 60.0, "R": DEG_H / 3600.0, "sigma_b": DEG_H}
"""arcsec, deg/√h, deg/h, deg/h/√h, deg/h/h, deg/h in SI."""
ACCEL = {"Q": 1e-3, "N": UG, "B": UG, "K": UG / 60.0, "R": UG / 3600.0, "sigma_b": UG}
"""mm/s, µg/√Hz, µg, µg/√h, µg/h, µg in SI."""
ESTIMATES = {
    "Q": (0.5, 0.25, 0.75), "N": (1.5, 1.25, 1.75), "B": (None, 0.0, 2.5), "K": (3.5, 3.25, 3.75),
    "R": (-4.5, -4.75, -4.25), "sigma_b": (5.5, 5.25, 5.75),
}  # fmt: skip
"""Value and band of each term in these units."""
UNIT_NAMES = {
    "Q": ("arcsec", "mm/s", "hPa·s"), "N": ("deg/√h", "µg/√Hz", "hPa/√Hz"), "B": ("deg/h", "µg", "hPa"),
    "K": ("deg/h/√h", "µg/√h", "hPa/√s"), "R": ("deg/h/h", "µg/h", "hPa/s"), "sigma_b": ("deg/h", "µg", "hPa"),
}  # fmt: skip
TERM_NAMES = {
    "Q": "quantisation", "N": "random walk", "B": "bias instability, flicker", "K": "rate random walk",
    "R": "rate ramp", "sigma_b": "Gauss-Markov bias, 1σ",
}  # fmt: skip


Terms = Mapping[str, tuple[float | None, float, float]]


def estimated(terms: Terms, sizes: Mapping[str, float]) -> dict[str, TermEstimate]:
    """Return estimates of values and bands in units of given sizes."""
    return {
        symbol: TermEstimate(value if value is None else value * size, low * size, high * size)
        for symbol, (value, low, high), size in ((s, t, sizes[s]) for s, t in terms.items())
    }


def fitted(sizes: dict[str, float], **changes: object) -> NoiseFit:
    """Return a fit with the terms above in units of given sizes, a mean of 2.5 units of B, and a sampling of 0.25 s."""
    estimates = estimated(ESTIMATES, sizes)
    likely = {symbol: one.value or 0.0 for symbol, one in estimates.items()}
    fit = NoiseFit(estimates, likely, 45.0, (30.0, 60.0), 0.25, 1200, 2.5 * sizes["B"], 0.0, (), (), None)
    return replace(fit, **changes)  # type: ignore[arg-type]


def channel(number: int, sizes: dict[str, float], **changes: object) -> ChannelNoise:
    """Return a channel with an Allan deviation at 0.25, 0.5 and 1 s, of 4, 3 and 3.5 units of B."""
    deviation = AllanDeviation(0.25, 1200, np.array([1, 2, 4]), np.array([4.0, 3.0, 3.5]) * sizes["B"])
    low, high = np.array([3.75, 2.75, 3.0]) * sizes["B"], np.array([4.5, 3.875, 3.75]) * sizes["B"]
    one = ChannelNoise(CHANNELS[number], deviation, np.array([800.0, 90.0, np.inf]), low, high, fitted(sizes), None)
    return replace(one, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("number", "sizes", "unit", "key"), [(1, GYRO, "deg/h", "_deg_h"), (5, ACCEL, "µg", "_ug"), (6, None, "hPa", "")]
)
def test_numbers_of_a_channel(number: int, sizes: dict[str, float] | None, unit: str, key: str) -> None:
    """The lowest deviation is that with the lowest upper end of the band, which is not the lowest of all."""
    of, plain = (GYRO, ACCEL, None)[min(number // 3, 2)], dict.fromkeys(SYMBOLS, 1.0)
    assert of is sizes
    one = channel(0, plain, channel=LogChannel("p", units_of("hPa"))) if sizes is None else channel(number, sizes)
    assert one.described
    assert one.symbols == ["Q", "N", "B", "K", "R", "sigma_b"]
    found = one.to_json()
    # at 1 s: 3·0.5² + 1.5² + 0·0.664² + 3.5²/3 + 4.5²/2 and that of the bias, in SI
    si = sizes or plain
    x = 1.0 / 45.0
    markov = 2.0 * 45.0 * (1.0 - 22.5 * (3.0 - 4.0 * np.exp(-x) + np.exp(-2.0 * x)))
    expected = np.sqrt(
        3.0 * (0.5 * si["Q"]) ** 2 + (1.5 * si["N"]) ** 2 + (3.5 * si["K"]) ** 2 / 3.0 + (4.5 * si["R"]) ** 2 / 2.0
        + (5.5 * si["sigma_b"]) ** 2 * markov
    )  # fmt: skip
    fit = found["allan"].pop(f"fit{key}")
    assert fit[2] * si["B"] == pytest.approx(expected, rel=1e-8)
    column = min(number // 3, 2)
    terms = {
        symbol: {"name": TERM_NAMES[symbol], "unit": UNIT_NAMES[symbol][column]}
        | dict(zip(("value", "low", "high"), numbers, strict=True))
        for symbol, numbers in ESTIMATES.items()
    }
    remarks = found.pop("remarks")
    nested = {name: found.pop(name) for name in ("terms", "allan")}
    for symbol, term in terms.items():
        assert nested["terms"][symbol] == {
            name: pytest.approx(value, rel=1e-12) if isinstance(value, float) else value for name, value in term.items()
        }
    assert list(nested["terms"]) == list(terms)
    allan = {
        "tau_s": [0.25, 0.5, 1.0], f"deviation{key}": [4.0, 3.0, 3.5], f"low{key}": [3.75, 2.75, 3.0],
        f"high{key}": [4.5, 3.875, 3.75], "degrees_of_freedom": [800.0, 90.0, None],
    }  # fmt: skip
    assert list(nested["allan"]) == list(allan)
    for name, values in allan.items():
        assert nested["allan"][name] == [None if v is None else pytest.approx(v, rel=1e-12) for v in values], name
    assert found == {
        "unit": unit, f"mean{key}": pytest.approx(2.5, rel=1e-12), "correlation_time_s": 45.0,
        "correlation_time_band_s": (30.0, 60.0), f"lowest_allan_deviation{key}": pytest.approx(3.5, rel=1e-12),
        "lowest_allan_deviation_tau_s": 1.0, "misfit": 0.0, "left_out_hz": (),
    }  # fmt: skip
    assert remarks == list(one.remarks())


def test_names_and_titles_of_channels() -> None:
    assert [one.title for one in CHANNELS] == [
        "gyro_x (forward)", "gyro_y (right)", "gyro_z (down)", "accel_x (forward)", "accel_y (right)", "accel_z (down)",
    ]  # fmt: skip
    assert LogChannel("p", units_of("hPa")).title == "p"
    assert NAMES == TERM_NAMES
    assert (symbol_text("sigma_b"), symbol_text("K")) == ("σ_b", "K")
    assert four_digits(12345.6) == "12346"
    assert four_digits(-0.000123456) == "-0.0001235"
    for triad, place in (("gyro", 0), ("accel", 1)):
        assert {symbol: unit for symbol, (unit, _) in UNITS[triad].terms.items()} == {  # type: ignore[index]
            symbol: names[place] for symbol, names in UNIT_NAMES.items()
        }
    assert UNITS["gyro"].rate == ("deg/h", pytest.approx(DEG_H, rel=1e-15))
    assert UNITS["accel"].rate == ("µg", pytest.approx(UG, rel=1e-15))


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("t_c", "°C"), ("t_degc", "°C"), ("p_pa", "Pa"), ("p_hpa", "hPa"), ("p_kpa", "kPa"), ("p_mbar", "mbar"),
        ("h_m", "m"), ("h_mm", "mm"), ("h_km", "km"), ("h_ft", "ft"), ("v_mps", "m/s"), ("f_mps2", "m/s²"),
        ("f_ug", "µg"), ("a_deg", "deg"), ("a_rad", "rad"), ("a_arcsec", "arcsec"), ("a_arcmin", "arcmin"),
        ("a_mrad", "mrad"), ("a_urad", "µrad"), ("w_dps", "deg/s"), ("w_deg_s", "deg/s"), ("w_rad_s", "rad/s"),
        ("w_deg_h", "deg/h"), ("f_hz", "Hz"), ("u_mv", "mV"), ("b_nt", "nT"), ("b_ut", "µT"), ("x_percent", "%"),
        ("deg_h", None),
    ],
)  # fmt: skip
def test_units_at_the_ends_of_names(name: str, unit: str | None) -> None:
    assert unit_in_name(name) == unit


# Each remark by its cause, on gyro_y and on a pressure.
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"exchangeable": ("K", "sigma_b")},
            "K and σ_b described the record best, but zero is in the band: an unobserved term could replace it.",
        ),
        (
            {"possible": (2.5 * DEG_H, 123.4)},
            "A Gauss-Markov bias of σ_b = 2.500 deg/h and τ_b = 123 s could explain this, but is not significant. If "
            "such a bias is known, give its --correlation-time.",
        ),
        (
            {"aside": ((2.0, 8.0), (0.5, 0.5))},
            "2 to 8 Hz (τ near 0.125 s) does not fit these terms and was left out: vibration, a filter or a resonance.",
        ),
        (
            {"misfit": 0.51},
            "These terms do not describe this record: bands of its spectrum depart from them by 51 % rms. Use a "
            "part in "
            "which the sensor stood still (--from, --to).",
        ),
        (
            {"misfit": 0.5},
            "These terms describe the spectrum to 50 % only; the bands of the terms include this. Check that "
            "the sensor "
            "stood still, at constant temperature.",
        ),
    ],
)
def test_remarks(changes: dict[str, object], said: str) -> None:
    one = channel(1, GYRO, fit=fitted(GYRO, **changes))
    assert list(channel(1, GYRO).remarks()) == []
    assert next(one.remarks()) == said


def test_remarks_on_pulses_and_spikes() -> None:
    """0.02 deg/√h over 0.25 s is 1.2·0.5 = 0.6 arcsec; a pulse of √12 · 0.5 arcsec is 1.732 arcsec: 0.346 of it."""
    few = {**fitted(GYRO).likely, "N": 0.02 * GYRO["N"]}
    said = (
        "Between samples the random walk moves the output {}. Unless the sensor moves by more (dither does), "
        "rounding "
        "errors are correlated and not white: Q, and with it N, is then not trusted."
    )
    moving = channel(1, GYRO, fit=fitted(GYRO, likely=few))
    assert list(moving.remarks()) == [said.format("by 0.35 pulses only")]
    still = channel(1, GYRO, fit=fitted(GYRO, likely={**few, "N": 0.0}))
    assert list(still.remarks()) == [said.format("by less than half a pulse, if at all")]
    enough = channel(1, GYRO, fit=fitted(GYRO, likely={**few, "N": 0.03 * GYRO["N"]}))  # 0.52 of a pulse
    assert list(enough.remarks()) == []
    pressure = channel(1, GYRO, channel=LogChannel("p", units_of("hPa")), fit=fitted(GYRO, likely=few, misfit=0.25))
    assert list(pressure.remarks()) == [
        "These terms describe the spectrum to 25 % only; the bands of the terms include this. Check that the "
        "quantity was "
        "steady, at constant temperature."
    ]
    jolted = channel(1, GYRO, spike=(123.5, 17.25))
    assert list(jolted.remarks()) == [
        "The sample at 123.5 s is 17.2 standard deviations off its neighbours: a spike or a jolt. Its power counts as "
        "noise; use a part without it (--from, --to)."
    ]


def samples(kind: str = "increments", time: object = None, **triads: object) -> Samples:
    time = np.array([10.0, 10.25, 10.5, 10.75, 11.0]) if time is None else np.asarray(time)
    return Samples(kind, time, {name: np.asarray(values) for name, values in triads.items()})  # type: ignore[arg-type, misc]


def report(*channels: ChannelNoise) -> NoiseReport:
    return NoiseReport("bench.csv", samples(), 0.25, channels, ("first", "second"))


def test_numbers_of_a_report() -> None:
    one, other = channel(4, ACCEL), channel(0, GYRO)
    assert report(one, other).to_json() == {
        "source": "bench.csv", "duration_s": 1.0, "samples": 4, "interval_s": 0.25, "remarks": ["first", "second"],
        "channels": {"accel_y": one.to_json(), "gyro_x": other.to_json()},
    }  # fmt: skip


def scaled(
    number: int, sizes: dict[str, float], mean: float, time: float, **values: tuple[float | None, float, float]
) -> ChannelNoise:
    """Return a channel with its own values and bands of some terms, in its units; no other term is observable."""
    given = {**dict.fromkeys(SYMBOLS, (None, 0.0, 0.125)), **values}
    if not time:
        del given["sigma_b"]
    estimates = estimated(given, sizes)
    likely = {symbol: one.value or 0.0 for symbol, one in estimates.items()}
    fit = fitted(sizes, estimates=estimates, likely=likely, mean=mean, correlation_time=time or None)
    return channel(number, sizes, fit=fit)


def test_the_table_of_a_unit() -> None:
    """Root mean squares over three axes: of 3, 4 and 12 it is 13/√3; Q times √12 is a pulse.

    √(120² + 90² + 80²) = 170 deg/h of the means exceeds three times the Earth's rate, and is 170/√3 deg/h an axis. The
    specific force √(0.6² + 0.8² + 9.9²) = 9.95038 m/s² is 0.14373 m/s² or 14 656 µg more than gravity.
    """
    axes = [
        scaled(0, GYRO, 120.0 * DEG_H, 45.0, Q=(0.5, 0.4, 0.6), N=(3.0, 2.0, 4.0), R=(-1.5, -2.0, -1.0),
               sigma_b=(2.0, 1.5, 2.5)),
        scaled(1, GYRO, -90.0 * DEG_H, 75.0, N=(4.0, 3.0, 5.0), sigma_b=(6.0, 5.5, 6.5)),
        scaled(2, GYRO, 80.0 * DEG_H, 0.0, N=(12.0, 11.0, 13.0), B=(None, 0.0, 0.75), K=(7.5, 7.0, 8.0)),
        scaled(3, ACCEL, 0.6, 0.0, N=(30.0, 29.0, 31.0), R=(None, -3.0, 2.0)),
        scaled(4, ACCEL, 0.8, 0.0, N=(40.0, 39.0, 41.0), B=(2.5, 2.0, 3.0)),
        scaled(5, ACCEL, -9.9, 0.0, N=(120.0, 119.0, 121.0)),
    ]  # fmt: skip
    lines = imu_block(report(*axes))
    quantum = 0.5 * np.sqrt(12.0)
    pulse = f"{0.125 * np.sqrt(12.0):.4f}"
    force = np.sqrt(0.36 + 0.64 + 9.9**2)
    expected = [
        ("rate_hz", 4.0, ""),
        ("gyro_bias_sigma_deg_h", 170.0 / np.sqrt(3.0), "the means 120, -90, 80 deg/h exceed the Earth's rate "
        "of 15.04"),
        ("gyro_quantum_arcsec", quantum / np.sqrt(3.0),
         "Q, quantisation: x 1.732, y not observable, z not observable"),
        ("gyro_arw_deg_sqrt_h", 13.0 / np.sqrt(3.0), "N, random walk: x 3.000, y 4.000, z 12.00"),
        ("gyro_flicker_deg_h", 0.0, "B, bias instability, flicker: not observable; below 0.7500"),
        ("gyro_rrw_deg_h_sqrt_h", 7.5 / np.sqrt(3.0), "K, rate random walk: x not observable, y not observable, "
        "z 7.500"),
        ("gyro_instability_deg_h", np.sqrt(40.0 / 3.0),
         "σ_b, Gauss-Markov bias, 1σ: x 2.000, y 6.000, z not observable"),
        ("gyro_correlation_time_s", 75.0, "τ_b of gyro_y"),
        ("gyro_ramp_deg_h_per_h", (-1.5, 0.0, 0.0), "R, rate ramp, of x, y, z; 0 where it is not observable"),
        ("accel_bias_sigma_ug", (force - 9.80665) / UG, "the magnitude of the means, 9.9504 m/s², is not gravity's"),
        ("accel_quantum_mm_s", 0.0, f"Q, quantisation: not observable; below {pulse}"),
        ("accel_vrw_ug_sqrt_hz", 130.0 / np.sqrt(3.0), "N, random walk: x 30.00, y 40.00, z 120.0"),
        ("accel_flicker_ug", 2.5 / np.sqrt(3.0), "B, bias instability, flicker: x not observable, y 2.500, z "
        "not observable"),
        ("accel_rrw_ug_sqrt_h", 0.0, "K, rate random walk: not observable; below 0.1250"),
        ("accel_instability_ug", 0.0, "σ_b, Gauss-Markov bias, 1σ: not observable"),
    ]  # fmt: skip
    assert [(line.key, line.why) for line in lines[1:]] == [(key, why) for key, _, why in expected]
    for line, (key, value, _) in zip(lines[1:], expected, strict=True):
        assert line.value == pytest.approx(value, rel=1e-9, abs=1e-12), key
    assert (lines[0].key, lines[0].why) == (
        "grade",
        "nearest in noise; scale factors and misalignments are the grade's",
    )


@pytest.mark.parametrize(("mean", "there"), [((40.0, 20.0, 8.0), True), ((36.0, 24.0, 12.0), False)])
def test_a_bias_of_gyros_is_seen_beyond_three_times_the_rate_of_the_earth(mean: tuple[float, ...], there: bool) -> None:
    """√(40² + 20² + 8²) = 45.43 deg/h, √(36² + 24² + 12²) = 44.90 deg/h; 3 · 15.041 = 45.12 deg/h."""
    axes = [scaled(k, GYRO, one * DEG_H, 0.0, N=(1.0, 0.5, 1.5)) for k, one in enumerate(mean)]
    assert ("gyro_bias_sigma_deg_h" in {line.key for line in imu_block(report(*axes))}) == there
    assert "gyro_bias_sigma_deg_h" not in {line.key for line in imu_block(report(*axes[:2]))}


@pytest.mark.parametrize(
    ("down", "there"),
    [(9.806 * 1.0035, False), (9.80665 * 1.0045, True), (9.80665 * 0.9955, True), (9.80665 * 1.0495, True),
     (9.80665 * 1.0505, False)],
)  # fmt: skip
def test_a_bias_of_accelerometers_is_seen_between_limits(down: float, there: bool) -> None:
    """More than the variation of gravity over the Earth, 0.4 %, and less than what is another unit, 5 %."""
    axes = [scaled(3 + k, ACCEL, one, 0.0, N=(1.0, 0.5, 1.5)) for k, one in enumerate((0.0, 0.0, -down))]
    found = {line.key: line.value for line in imu_block(report(*axes))}
    assert ("accel_bias_sigma_ug" in found) == there
    if there:
        assert found["accel_bias_sigma_ug"] == pytest.approx(abs(down - 9.80665) / UG, rel=1e-9)


def test_the_text_of_the_table() -> None:
    lines = [
        ImuLine("grade", "tactical", "near"),
        ImuLine("rate_hz", 123.4567, ""),
        ImuLine("ramp", (1.23456, -2.5, 0.0), "R"),
    ]
    said = ['grade = "tactical"  # near', "rate_hz = 123.5", "ramp = [1.235, -2.5, 0]  # R"]
    assert list(map(str, lines)) == said
    shaken = channel(2, GYRO, fit=fitted(GYRO, misfit=0.625, aside=((0.1234, 0.5678), (1.5, 2.5))))
    pressure = replace(channel(3, ACCEL, fit=fitted(ACCEL, misfit=0.75)), channel=LogChannel("p", units_of("hPa")))
    text = block_text(report(shaken, pressure)).splitlines()
    assert text[:2] == ["[imu]", "# noise of bench.csv: 1 s at 4 Hz; the root mean square of the axes"]
    assert text[-3:] == [
        "# not included: gyro_z from 0.123 to 0.568 Hz, vibration or a resonance",
        "# not included: gyro_z from 1.5 to 2.5 Hz, vibration or a resonance",
        "# doubtful: these terms do not describe gyro_z (its spectrum departs by 62 % rms): the unit moved or shook",
    ]
    assert not any("accel" in line for line in text)
    with pytest.raises(InputError, match=r"bench\.csv: no gyro or accelerometer was analysed"):
        imu_block(report(pressure))


def test_the_grade_is_the_nearest_by_ratio() -> None:
    """Random walks of the gyros of all grades: each is its own nearest, and the geometric mean of two is the border."""
    from sinssim.sensors.imu.grades import GRADE_TABLE

    walks = {name: grade.gyro.random_walk for name, grade in GRADE_TABLE.items() if grade.gyro.random_walk > 0.0}
    ordered = sorted(walks.items(), key=lambda pair: pair[1])
    for (one, low), (other, high) in pairwise(ordered):
        if high < 1.05 * low:
            continue
        border = np.sqrt(low * high)
        for walk, near in ((border / 1.01, low), (border * 1.01, high)):
            grade = imu_block(report(scaled(0, GYRO, 0.0, 0.0, N=(walk / GYRO["N"], 0.0, 1.0))))[0].value
            assert walks[str(grade)] == near, (one, other)


def test_a_part_of_a_log_holds_the_intervals_between_two_times() -> None:
    """Edges at 10, 10.25 … 11 s; rows belong to the intervals between them."""
    rows = np.arange(12.0).reshape(4, 3)
    whole = replace(samples(gyro=rows), quantities={"p": np.array([5.0, 6.0, 7.0, 8.0])})
    found = part(whole, 10.25, 10.75, "log.csv")
    assert found.time.tolist() == [10.25, 10.5, 10.75]
    assert found.triads["gyro"].tolist() == [[3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]
    assert found.quantities["p"].tolist() == [6.0, 7.0]
    assert part(whole, 10.1, None, "log.csv").time.tolist() == [10.25, 10.5, 10.75, 11.0]
    assert part(whole, None, 10.6, "log.csv").time.tolist() == [10.0, 10.25, 10.5]
    with pytest.raises(
        InputError,
        match=r"log\.csv: there are no samples from 10\.6 s to 10\.9 s; the log runs "
        "from 10 to 11 s",
    ):
        part(whole, 10.6, 10.9, "log.csv")


def test_the_clock_of_a_log() -> None:
    """Steps of 0.25, 0.30, 0.20 and 0.25 s: the mean is 0.25 s, the largest departure a fifth of it."""
    found = clock(samples(time=[10.0, 10.25, 10.55, 10.75, 11.0]), "log.csv")
    assert (found.interval, found.unevenness) == (pytest.approx(0.25), pytest.approx(0.2))
    assert not found.even
    assert clock(samples(time=[0.0, 1.0, 2.0095, 3.0, 4.0]), "log.csv").even
    assert not clock(samples(time=[0.0, 1.0, 2.0105, 3.0, 4.0]), "log.csv").even
    gap = r"log\.csv, sample 2: there are no samples for 20 s from 2 s on; usual intervals are 1 s"
    with pytest.raises(InputError, match=gap):
        clock(samples(time=[0.0, 1.0, 2.0, 22.0, 23.0, 24.0]), "log.csv")
    with pytest.raises(InputError, match=r"samples every 2e\+06 s are impossible"):
        clock(samples(time=[0.0, 2e6, 4e6]), "log.csv")


def test_increments_on_even_intervals() -> None:
    """Edges at 0, 1.2, 2 and 3 s; the nearest to the even ones at 0, 1, 2 and 3 s are these in the same order."""
    rows = np.array([[1.0, 2.0, 5.0], [3.0, 4.0, 9.0], [5.0, 6.0, 13.0]])
    even, uneven = [0.0, 0.5, 1.0, 1.5], [0.0, 1.2, 2.0, 3.0]
    for kind, factor in (("increments", 1.0), ("rates", 0.5)):
        log = samples(kind, even, gyro=rows, accel=10.0 * rows)
        timing = clock(log, "log")
        assert even_increments(log, CHANNELS[2], timing).tolist() == [5.0 * factor, 9.0 * factor, 13.0 * factor]
        assert even_increments(log, CHANNELS[4], timing).tolist() == [20.0 * factor, 40.0 * factor, 60.0 * factor]
    # increments 5, 9, 13: the mean rate is 9 a second, the departures −5.8, 1.8 and 4 are added to 9 a second
    log = samples("increments", uneven, gyro=rows)
    np.testing.assert_allclose(even_increments(log, CHANNELS[2], clock(log, "log")), [3.2, 10.8, 13.0], rtol=1e-12)
    # readings 5, 9, 13 of a mean of 9: the departures are −4·1.2, 0 and 4 s
    log = samples("rates", uneven, gyro=rows)
    np.testing.assert_allclose(even_increments(log, CHANNELS[2], clock(log, "log")), [4.2, 9.0, 13.0], rtol=1e-12)


def test_a_band_is_that_of_chi_square() -> None:
    """10 degrees of freedom: 20.483 and 3.247 at 95 % (tables of χ²); 15.987 and 4.865 at 80 %; none has no band."""
    low, high = confidence_band(np.array([2.0, 3.0]), np.array([10.0, np.inf]))
    np.testing.assert_allclose(
        [low, high], [[2.0 * np.sqrt(10 / 20.483), 3.0], [2.0 * np.sqrt(10 / 3.247), 3.0]], rtol=2e-5
    )
    low, high = confidence_band(np.array([2.0]), np.array([10.0]), 0.8)
    np.testing.assert_allclose([low[0], high[0]], [2.0 * np.sqrt(10 / 15.987), 2.0 * np.sqrt(10 / 4.865)], rtol=3e-5)
    assert chi2.sf(20.483, 10) == pytest.approx(0.025, rel=1e-3)


@pytest.mark.parametrize(("factor", "said"), [(1.045, False), (1.055, True), (0.955, False), (0.945, True)])
def test_gravity_within_five_per_cent(tmp_path: Path, factor: float, said: bool) -> None:
    """300 samples of rates at 4 Hz, 4.5 % beside gravity and 5.5 %."""
    rng = np.random.default_rng(2)
    rows = rng.normal(0.0, 1e-3, (300, 3)) + factor * 9.80665 * np.array([0.36, -0.48, -0.8])
    np.savez(tmp_path / "log.npz", t=0.25 * np.arange(1, 301), f=rows)
    (tmp_path / "log.toml").write_text(
        'kind = "rates"\ntime = "t"\ntime_unit = "s"\n[accel]\ncolumns = "f"\nunit = "m/s^2"\n'
    )
    found = noise_report(tmp_path / "log.npz", columns=tmp_path / "log.toml", channels=["accel_y"])
    assert found.channels[0].fit.mean == pytest.approx(-0.48 * factor * 9.80665, rel=1e-3)
    assert found.interval == pytest.approx(0.25)
    expected = (
        f"The mean specific force is {factor * 9.80665:.4g} m/s²; at rest it would be 9.807 m/s². Unless "
        f"gravity has been "
        "removed, the log's units, times or kind (increments or rates) are wrong."
    )
    assert found.remarks == ((expected,) if said else ())


def test_the_size_of_a_spike() -> None:
    """Second differences of 0, 1, 0, 1, … are 2, which is 0.6745 σ; that of a sample with 100 more is 202."""
    increments = np.tile([0.0, 1.0], 20)
    increments[7] += 100.0
    found = spike_of(increments, 5.0 + 0.25 * np.arange(41))
    assert found == (7.0, pytest.approx(202.0 / 2.0 * 0.6745))  # the end of the eighth interval
    increments[7] = 16.0  # 32 are 10.8 σ; 29 would be 9.8 σ
    assert spike_of(increments, np.arange(41.0)) == (8.0, pytest.approx(16.0 * 0.6745))
    increments[7] = 14.5
    assert spike_of(increments, np.arange(41.0)) is None
