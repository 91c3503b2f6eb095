"""The page of the fourteen questions: complete, its numbers as theory has them, its diagrams legible."""

from __future__ import annotations

import importlib.util
import math
import re
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from sinssim.recording.diagrams import DIAGRAMS
from tests.recording.drawings import check_words, words_of

DOCS = Path(__file__).parents[1] / "docs"


@cache
def _load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # docs/questions.py imports question_numbers
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def numbers() -> ModuleType:
    return _load("question_numbers")


@pytest.fixture(scope="module")
def diagrams() -> ModuleType:
    return _load("diagrams")


@pytest.mark.slow
def test_answers_are_complete_and_their_links_lead_somewhere(numbers):
    answers = _load("questions").answers()
    assert re.findall(r"^## (\d+)\.", answers, re.MULTILINE) == [str(n) for n in range(1, 15)]
    assert "nan" not in answers
    for link in re.findall(r"\]\(([\w./-]+)\)", answers):
        assert (DOCS / link).exists(), link


def test_roll_and_loop_by_theory(numbers):
    # 10 ppm of ten turns; the Earth's rate adds less than 15″/s · 15 s · 10 ppm
    assert numbers.roll().scaled_arcsec == pytest.approx(1e-5 * 3600.0 * 3600.0, abs=0.01)
    assert numbers.roll().perfect_arcsec < 1e-6
    assert numbers.loop().quaternion_arcsec < 1e-6


def test_coning_drift_by_theory(numbers):
    """The drift that first order leaves out.

    The body turns about the cone's axis at Ω(1 − cos a) by its solid angle. Steps of plain increments follow a regular
    polygon: for a small cone its area is that of the circle times sin Ωh/Ωh, and the first step of the half angle's
    tangent adds no drift along the axis.
    """
    cone, turn = np.radians(1.0), 2.0 * np.pi
    for rate in (20.0, 50.0, 100.0, 200.0):
        x = turn / rate
        solid = turn * (1.0 - math.cos(cone)) * 60.0
        expected = np.degrees(solid * (1.0 - math.sin(x) / x)) * 3600.0
        assert numbers.coning(rate) == pytest.approx(expected, rel=5e-3)


def test_variants_by_the_powers_of_time(numbers):
    found = numbers.variants((10.0, 20.0))
    for name, power in (("accelerometers", 4), ("gyros", 3), ("attitude", 2)):
        assert found[name][1] / found[name][0] == pytest.approx(2.0**power, rel=0.02)
    # ½ g α t², g Δω t³/6, and by an angular acceleration of σ/(√2 ℓ) g σ t⁴/(24 √2 ℓ)
    seconds, g = 10.0, 9.81
    tilt, drift, bias = np.radians(10.0 / 3600.0), np.radians(0.01) / 3600.0, 9.80665e-6
    assert found["attitude"][0] == pytest.approx(0.5 * g * tilt * seconds**2, rel=1e-3)
    assert found["gyros"][0] == pytest.approx(g * drift * seconds**3 / 6.0, rel=1e-3)
    assert found["accelerometers"][0] == pytest.approx(g * bias * seconds**4 / (24.0 * math.sqrt(2.0)), rel=2e-3)


def test_one_component_by_theory(numbers):
    by_accelerometer, by_gyro = numbers.pendulum(True), numbers.pendulum(False)
    assert by_accelerometer.largest_arcmin == pytest.approx(np.degrees(2.0 * 100e-6 * 9.80665 / 9.81) * 60.0, rel=1e-6)
    assert by_gyro.after_period_arcmin == pytest.approx(0.01 * by_gyro.period_min, rel=1e-6)  # 0.01 °/h = 0.01′/min
    assert by_gyro.hourly_nmi == pytest.approx(0.6, rel=1e-6)
    assert max(by_accelerometer.apart, by_gyro.apart) < 1e-6


def test_specific_force_and_rates_by_theory(numbers):
    force, (rate, of_earth) = numbers.force(), numbers.northward()
    a, e2, sine = 6378137.0, 0.00669437999, math.sin(math.radians(50.0))
    r1, r2 = a * (1 - e2) / (1 - e2 * sine**2) ** 1.5 + 9000.0, a / math.sqrt(1 - e2 * sine**2) + 9000.0
    north, east, _ = numbers.flight().state(0.0).velocity_ned
    assert (math.hypot(north, east), math.degrees(math.atan2(east, north))) == pytest.approx((250.0, 60.0), rel=2e-3)
    tangent = math.tan(math.radians(50.0))
    level = math.hypot(east**2 / r2 * tangent, north * east / r2 * tangent)  # the north and east parts of ω × V
    down = north**2 / r1 + east**2 / r2
    assert force.transport == pytest.approx(math.hypot(level, down), rel=1e-9)
    # 2Ω × V: its part across the axis of the Earth
    axis = np.array([math.cos(math.radians(50.0)), 0.0, -sine])
    across = np.array([north, east, 0.0]) - (north * axis[0]) * axis
    assert force.coriolis == pytest.approx(2 * 7.292115e-5 * float(np.linalg.norm(across)), rel=1e-9)
    # the deflection of the vertical at 9 km, 8.1e-9·h sin 2B, drives a Schuler oscillation for half an hour
    drive, schuler = 8.1e-9 * 9000.0 * math.sin(math.radians(100.0)), math.sqrt(force.gravity / 6.38e6)
    assert force.order_4_m == pytest.approx(drive / schuler**2 * (1 - math.cos(schuler * 1800.0)), rel=0.05)
    assert rate == pytest.approx(math.degrees(1100.0 / 3.6 / r1) * 3600.0, rel=1e-9)
    assert of_earth == pytest.approx(15.041, abs=1e-3)
    assert numbers.tilted_nmi() == pytest.approx(2.0, rel=0.01)  # 1′ there and back, at the far point 2′


@pytest.mark.usefixtures("hardly_counted")
def test_advantages_and_difficulties_by_theory(numbers):
    """tr (HᵀH)⁻¹ of six best directions is 9/6; steps leave φ³/6 and φ³/24; a misaligned axis turns by 180°."""
    redundancy, exposure, steps, matrices = (
        numbers.redundancy(), numbers.exposure(), numbers.steps(), numbers.matrices(),
    )  # fmt: skip
    assert redundancy.all_six == pytest.approx(math.sqrt(9.0 / 6.0 / 3.0), rel=1e-9)
    assert redundancy.isolable_after == 2
    assert exposure.misaligned_arcsec == pytest.approx(2.0 * 5.0, rel=1e-3)
    assert exposure.platform_arcsec == pytest.approx(1e-5 * 15.041 * 15.0, rel=1e-4)
    azimuth = math.degrees(0.01 / 15.041 / math.cos(math.radians(50.0))) * 60.0
    assert numbers.azimuth_arcmin() == pytest.approx(azimuth, rel=1e-4)
    assert steps.matrix_arcsec / steps.quaternion_arcsec == pytest.approx(4.0, rel=0.01)
    assert steps.quaternion_skew < 1e-15 < 1.0 < steps.matrix_skew
    assert (matrices.by_products, matrices.by_functions) == (45.0, 18.0 + 6.0 * 24.0)


def test_levels_by_the_square_of_the_interval(numbers):
    at_20, at_10 = numbers.levels((200.0, 20.0, 20.0))[0], numbers.levels((200.0, 10.0, 10.0))[0]
    assert at_10 / at_20 == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("name", [*DIAGRAMS, "floors"])
def test_diagrams_are_up_to_date_and_legible(name, diagrams, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["diagrams.py", "-o", str(tmp_path)])
    diagrams.main()
    drawn, kept = ((folder / f"{name}.svg").read_text(encoding="utf-8") for folder in (tmp_path, DOCS / "images"))
    assert drawn == kept, "python docs/diagrams.py"
    check_words(kept)


def test_diagrams_have_what_the_chapters_have():
    """Axes of the start (8.1, 8.2), the loop closed over y (8.3), three turns and the vectors of their rates (8.7)."""
    words = {name: set(words_of(draw())) for name, draw in DIAGRAMS.items()}
    assert {"ξ0", "η0"} <= words["one_component_axes"]
    assert "α = ∫ω dt + y" in words["one_component_scheme"]
    assert {"−ψ", "ϑ", "γ", "ψ̇", "ϑ̇", "γ̇"} <= words["frames"]
