"""The gravity field, distances from a track's samples, and coordinates in a report, from values that are chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.exhibits import Sentence
from sinssim.experiments.run.parts.motion_source import Track, TrueGravity
from sinssim.experiments.studies import study_exhibits
from sinssim.simulation.truth_and_sensors import Truth
from sinssim.truth.sampling import Channel
from sinssim.truth.true_gravity_disturbance import Disturbed
from tests.recording.spies import Shown, cells, read

ORANGE, GREEN, BLUE = "#d55e00", "#009e73", "#56b4e9"
ARCSEC = np.pi / 648_000.0


def test_deflections_and_disturbance() -> None:
    """ξ is to the north, η to the east; 1 mGal is 1e-5 m/s²."""
    time = np.array([5.0, 6.0, 8.0])
    values = SimpleNamespace(time=time, xi=np.array([1.0, -2.0, 4.0]) * ARCSEC, eta=np.array([5.0, 7.0, -3.0]) * ARCSEC,
                             disturbance=np.array([3e-4, -5e-4, 7e-4]), anomaly=np.ones(3), undulation=None,
                             altitude_msl=None)  # fmt: skip
    navigation = SimpleNamespace(gravity_degree=None)
    run: Any = SimpleNamespace(scenario=SimpleNamespace(navigation=navigation))
    part = TrueGravity(run)
    vars(part)["values"] = values
    found = Shown(part.exhibits())
    found.curves("gravity/deflection", "Deflection of the vertical", "arcsec",
                 ("ξ, north", ORANGE, time, [1.0, -2.0, 4.0]), ("η, east", GREEN, time, [5.0, 7.0, -3.0]))  # fmt: skip
    found.curves("gravity/disturbance", "Gravity beyond normal gravity", "mGal",
                 ("gravity disturbance, down", BLUE, time, [30.0, -50.0, 70.0]))  # fmt: skip
    assert {found.span(key) for key in found.charts} == {(5.0, 8.0)}
    assert not found.drawn.lines
    # rms: √((1 + 4 + 16)/3) and √((25 + 49 + 9)/3); √((9 + 25 + 49)/3) × 10
    for degree, known in ((None, "normal gravity alone"), (36, "the field to degree 36")):
        navigation.gravity_degree = degree
        (line,) = part.brief({})
        assert line == Sentence(
            "True gravity along the motion: deflection of the vertical 2.65 arcsec to the north and 5.26 arcsec to the "
            f"east, disturbance 52.6 mGal, rms; the navigator knows {known}.", on=("console",),
        )  # fmt: skip
    normal: Any = SimpleNamespace(truth=Truth(SimpleNamespace(), None, 1.0, time))  # type: ignore[arg-type]
    assert not TrueGravity.belongs_to(normal)
    normal = SimpleNamespace(truth=Truth(Disturbed.__new__(Disturbed), None, 1.0, time))  # type: ignore[arg-type]
    assert TrueGravity.belongs_to(normal)


def test_a_track_and_its_distance_from_the_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = SimpleNamespace(warnings=("Too <fast>.",), notes=("One sample was left out.",))
    asked = []
    monkeypatch.setattr("sinssim.truth.track_curve.fit_lines", lambda one: [("largest speed", "12 m/s & more")])
    monkeypatch.setattr("sinssim.truth.track_curve.fit_sentences", lambda one: ["It is close."])
    section = SimpleNamespace(
        waypoints=(), what="a.csv", vehicle="land",
        prepared=lambda earth: asked.append(earth) or SimpleNamespace(fit=fit),  # type: ignore[func-returns-value]
    )  # fmt: skip
    scenario: Any = SimpleNamespace(track=section, truth="earth")
    time, other = np.array([7.0, 8.0, 9.0]), np.array([7.5, 8.5])
    channels = {
        "horizontal_from_samples_m": Channel(time, np.array([1.0, 3.0, 2.0]), "m"),
        "height_above_samples_m": Channel(time, np.array([-0.5, 0.25, 0.75]), "m"),
        "angle_from_samples_rad": Channel(other, np.radians([0.5, -1.5]), "rad"),
    }
    truth = Truth(SimpleNamespace(channels=channels, start=6.5, end=9.5), None, 1.0, time)  # type: ignore[arg-type]
    part = Track(SimpleNamespace(scenario=scenario, truth=truth))  # type: ignore[arg-type]
    found = Shown(part.exhibits())
    assert asked == ["earth"]
    assert cells(found.html) == [["recorded track", ""], ["made from", "a.csv"], ["vehicle", "land"],
                                 ["largest speed", "12 m/s &amp; more"]]  # fmt: skip
    assert '<p class="broken">Too &lt;fast&gt;.</p>' in found.html
    assert "One sample was left out." in found.html
    found.curves("track/distance", "Distance of the curve from the samples", "m",
                 ("horizontal", GREEN, time, [1.0, 3.0, 2.0]),
                 ("vertical, up", BLUE, time, [-0.5, 0.25, 0.75]))  # fmt: skip
    found.curves("track/angle", "Angle from the recorded attitude", "deg", ("angle", ORANGE, other, [0.5, -1.5]))
    assert found.span("track/distance") == found.span("track/angle") == (6.5, 9.5)
    brief: list[Any] = list(part.brief({}))
    assert [(one.text, one.on) for one in brief] == [("It is close.", ("console",))]
    section.waypoints = ("a",)
    planned = Shown(part.exhibits())
    assert "<h3>The planned route</h3>" in planned.html
    assert not planned.charts
    scenario.track = None
    assert not Track.belongs_to(part.run)


def test_largest_errors_in_further_coordinates(monkeypatch: pytest.MonkeyPatch) -> None:
    """rad as seconds of arc, the units of lengths and speeds as they are; only the row's own case."""
    monkeypatch.setattr(study_exhibits, "labeller", lambda rows, pace: lambda row: f"engine {row.case}")
    rows: Any = [SimpleNamespace(case=k, motion=f"motion {k}") for k in (3, 4, 5)]
    kind = "earth-fixed"

    def error(case: int, column: str, largest: float, of: str = kind) -> Any:
        return SimpleNamespace(coordinates=of, case=case, column=column, max_error=largest)

    study: Any = SimpleNamespace(
        coordinate_errors=[
            error(3, "x_e_m", 12.5), error(3, "vz_e_mps", 0.0625), error(3, "attitude_rad", 40.0 * ARCSEC),
            error(4, "x_e_m", 2.5), error(4, "vz_e_mps", 0.5), error(4, "attitude_rad", 4.0 * ARCSEC),
            error(5, "defect", 0.125, "inertial"),
        ]
    )  # fmt: skip
    part: Any = SimpleNamespace(coordinates=(kind,))
    monkeypatch.setitem(study_exhibits.COORDINATES, kind, "along & across")
    shown = Shown(study_exhibits._coordinates(study, part, rows))
    assert "in the coordinates earth-fixed" in shown.html
    assert "Along &amp; across. Computed minus true" in shown.html
    assert cells(shown.html) == [
        ["motion", "", "x e, m", "vz e, m/s", "attitude, ″"],
        ["motion 3", "engine 3", "12.5", "0.0625", "40.0"], ["motion 4", "engine 4", "2.50", "0.500", "4.00"],
    ]  # fmt: skip
    part.coordinates = ("inertial",)
    monkeypatch.setitem(study_exhibits.COORDINATES, "inertial", "inertial axes")
    defects = Shown(study_exhibits._coordinates(study, part, rows))
    assert cells(defects.html) == [["motion", "", "defect"], ["motion 5", "engine 5", "0.125"]]
    assert read(shown.html)
