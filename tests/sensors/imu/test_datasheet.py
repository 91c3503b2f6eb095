"""Lines of datasheets in SI: worked examples by hand, and every unit of every quantity against another one."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from pydantic import ValidationError

from sinssim.errors import InputError
from sinssim.scenario.load import load_scenario
from sinssim.sensors.imu.datasheet_lines import line, to_si
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.sensors.imu.imu_section import Imu

# what the datasheet says, key, number, SI worked out by hand
with (Path(__file__).parents[3] / "docs" / "datasheet_lines.csv").open(encoding="utf-8", newline="") as _file:
    _, *_rows = csv.reader(_file)
EXAMPLES = [(said, key, float(number), float(si)) for said, key, number, si in _rows]
"""Lines of datasheets with the values that were worked out by hand, which the page shows."""


@pytest.mark.parametrize(("said", "key", "number", "si"), EXAMPLES, ids=[example[0] for example in EXAMPLES])
def test_worked_examples(said: str, key: str, number: float, si: float) -> None:
    assert to_si(key, number) == pytest.approx(si, rel=1e-5, abs=0.0)


@pytest.mark.parametrize("quantity", TERMS, ids=lambda quantity: quantity.name)
def test_every_unit_of_a_quantity_loads_as_the_same_error(quantity) -> None:
    size = {3: [1.0, 2.0, 3.0], 6: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 9: [float(n) for n in range(9)]}.get(
        quantity.size, 2.0
    )
    for unit, factor in quantity.units.items():
        per = quantity.unit / factor * 1e-3
        scaled = [value * per for value in size] if isinstance(size, list) else size * per
        section = Imu.model_validate({f"{quantity.name}_{unit}": scaled})
        found = getattr(section, quantity.key)
        expected = tuple(value * 1e-3 for value in size) if isinstance(size, list) else size * 1e-3
        assert found == pytest.approx(expected, rel=1e-14)
        if quantity.drawn:
            section = Imu.model_validate({f"{quantity.name}_sigma_{unit}": per})
            assert getattr(section, quantity.sigma_key) == pytest.approx(1e-3, rel=1e-14)


def test_keys_of_a_scenario_are_keys_of_the_table() -> None:
    for quantity in TERMS:
        assert quantity.key in Imu.model_fields
        assert (quantity.sigma_key in Imu.model_fields) == quantity.drawn
        found = line(quantity.key)
        assert found is not None
        assert found.term == quantity
        assert not found.sigma
    stated = {key for key in Imu.model_fields if key.startswith(("gyro_", "accel_"))}
    stated -= {"accel_arms_mm", "accel_delay_ms"}
    assert stated == {key for q in TERMS for key in (q.key, q.sigma_key) if key in Imu.model_fields}


def test_unknown_units_and_quantities() -> None:
    with pytest.raises(
        InputError, match="gyro_arw cannot be given in 'deg_min'; known units: deg_sqrt_h, deg_h_sqrt_hz"
    ):
        to_si("gyro_arw_deg_min", 1.0)
    with pytest.raises(InputError, match="unknown quantity in 'gyro_colour_red'; known: gyro_bias, "):
        to_si("gyro_colour_red", 1.0)
    with pytest.raises(InputError, match="gyro_arw cannot be given in 'sigma_deg_sqrt_h'"):
        to_si("gyro_arw_sigma_deg_sqrt_h", 1.0)  # a noise is not drawn
    with pytest.raises(InputError, match="gyro_bias_deg_h = nan is not a finite number"):
        to_si("gyro_bias_deg_h", float("nan"))


HEAD = "[parked]\nlatitude_deg = 50.0\nduration_s = 5.0\n[imu]\n"


REFUSED = [
    (
        "gyro_arw_deg_min = 0.1",
        r"line 5: unknown key 'imu.gyro_arw_deg_min' \(= 0.1\): gyro_arw cannot be given in 'deg_min'; known units: ",
    ),
    (
        "accel_bias_sigma_mg = -1.0",
        r"line 5: imu.accel_bias_sigma_ug = -1000.0 must be at least 0 \(given as imu.accel_bias_sigma_mg\)",
    ),
    ("gyro_bias_sigma_deg_s = 1e5", r"line 5: imu.gyro_bias_sigma_deg_h: 3.6e\+08 is larger than .* at most 3.6e\+06"),
    ("gyro_bias_deg_h = [0.0, -1e300, 0.0]", r"gyro_bias_deg_h: -1e\+300 is larger than that of any sensor"),
    (
        "gyro_quantum_arcsec = 2e6",
        "gyro_quantum_arcsec: 2e.06 is larger than that of any sensor; its magnitude must be at most 1.296e.06",
    ),
    ("gyro_misalignment_arcsec = [1.0, 2.0]", "line 5: imu.gyro_misalignment_arcsec must have 6 entries, and has 2"),
    ("accel_arms_mm = [[1.0, 0.0, 0.0]]", "line 5: imu.accel_arms_mm must have 3 entries, and has 1"),
    ("accel_arms_mm = [[1e5, 0, 0], [0, 0, 0], [0, 0, 0]]", r"accel_arms_mm\.1\.1 = 100000\.0 must be at most 10000"),
    ("rate_hz = 1e12", r"line 5: imu.rate_hz = 1e\+12 must be at most 100000"),
    ("temperature_start_c = -501.0", "temperature_start_c = -501.0 must be at least -500"),
    ('faults = {type = "freeze", from_s = 0.0}', r"must be an array of tables, each headed \[\[imu.faults\]\]"),
    (
        'faults = [{type = "spike", at_s = 3.0, accel_mm_s = [1e9, 0, 0]}]',
        r"accel_mm_s: 1e\+09 is larger than that of any",
    ),
    (
        'faults = [{type = "bias-step", from_s = 3.0, accel_ug = [1e9, 0, 0]}]',
        r"accel_ug: 1e\+09 is larger than that of any",
    ),
    ("gyro_arw_deg_sqrt_h = -0.1", "line 5: imu.gyro_arw_deg_sqrt_h = -0.1 must be at least 0"),
    ("gyro_flicker_deg_h = -0.1", "line 5: imu.gyro_flicker_deg_h = -0.1 must be at least 0"),
    ("accel_correlation_time_s = 0.0", "line 5: imu.accel_correlation_time_s = 0.0 must be greater than 0"),
    ("warm_up_time_s = 0.0", "line 5: imu.warm_up_time_s = 0.0 must be greater than 0"),
    ("gyro_range_deg_s = 0.0", "line 5: imu.gyro_range_deg_s = 0.0 must be greater than 0"),
    (
        "gyro_misalignment_arcsec = [0.0, 0.0, 50000.0, 0.0, 0.0, 0.0]",
        r"imu\.gyro_misalignment_arcsec\.3 = 50000\.0 must be at most 40000",
    ),
    ("accel_misalignment_sigma_mrad = 100.0", r"accel_misalignment_sigma_arcsec = 2062\d.* must be at most 10000"),
    ("gyro_scale_ppm = [0.0, -1e6, 0.0]", r"imu\.gyro_scale_ppm\.2 = -1000000\.0 must be greater than -1e\+06"),
    (
        "gyro_bias_sigma_deg_h = 1.0\ngyro_bias_sigma_deg_s = 1.0",
        "sigma_deg_h is given twice, in two units: keep one of them .given as imu.gyro_bias_sigma_deg_s",
    ),
    (
        "gyro_asymmetry_ppm = 5.0",
        "a list with one number per axis; the 1σ of a random error is gyro_asymmetry_sigma_ppm",
    ),
    ("accel_delay_ms = 11.0", r"accel_delay_ms = 11 exceeds .* at rate_hz = 100 .* at most 10"),
    ('faults = [{type = "jitter", from_s = 0.0, sigma_ms = 2.0}]', r"faults\.1\.sigma_ms = 2 .* at most 1, a tenth"),
    ('faults = [{type = "dropout", from_s = 3.0, to_s = 2.0}]', "to_s = 2 must be later than from_s = 3"),
    ('faults = [{type = "freeze", from_s = 3.0, channels = ["gyro_w"]}]', r"'gyro_w' is not known.* Known: gyro_x,"),
    ('faults = [{type = "spyke", at_s = 3.0}]', r"'spyke' is not known\. Did you mean 'spike'\?"),
    ('faults = [{type = "spike", at_s = 3.0}]', "the spike has no size: give gyro_arcsec or accel_mm_s"),
    ('faults = [{type = "bias-step", from_s = 3.0}]', "the step has no size"),
    ('faults = [{type = "saturation", from_s = 3.0}]', "the saturation has no range"),
    ('sensor_set = {type = "accelerometers", arm_m = 0.1}\naccel_delay_ms = 1.0', "accel_delay_ms needs a block with"),
]


@pytest.mark.parametrize(("text", "message"), REFUSED, ids=[text for text, _ in REFUSED])
def test_what_a_scenario_refuses(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "block.toml"
    file.write_text(HEAD + text + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_scenario(file)


def test_a_mistake_in_a_sigma_is_not_said_to_be_given_as_the_error(tmp_path: Path) -> None:
    file = tmp_path / "block.toml"
    file.write_text(HEAD + "gyro_bias_deg_h = [1.0, 0.0, 0.0]\ngyro_bias_sigma_deg_h = -1.0\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"line 6: imu.gyro_bias_sigma_deg_h = -1.0 must be at least 0\.$"):
        load_scenario(file)


def test_what_is_no_number_stays_for_the_schema_to_refuse() -> None:
    with pytest.raises(ValidationError, match="valid number"):
        Imu.model_validate({"gyro_arw_deg_h_sqrt_hz": "much"})
    with pytest.raises(ValidationError, match="valid number"):
        Imu.model_validate({"accel_bias_mg": [True, 0.0, 0.0]})
