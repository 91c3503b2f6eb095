"""The gravity field, distances from a track's samples, and coordinates in a report, from values that are chosen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sinssim.experiments.run.report import gravity, track_source
from sinssim.experiments.studies import coordinates_report as coordinates
from sinssim.truth.channel import Channel
from sinssim.truth.gravity.disturbed import Disturbed
from tests.recording.spies import Plots, cells, read

ORANGE, GREEN, BLUE = "#d55e00", "#009e73", "#56b4e9"
ARCSEC = np.pi / 648_000.0


def test_deflections_and_disturbance(plots: Plots, monkeypatch: pytest.MonkeyPatch) -> None:
    """ξ is to the north, η to the east; 1 mGal is 1e-5 m/s²."""
    time = np.array([5.0, 6.0, 8.0])
    values = SimpleNamespace(time=time, xi=np.array([1.0, -2.0, 4.0]) * ARCSEC, eta=np.array([5.0, 7.0, -3.0]) * ARCSEC,
                             disturbance=np.array([3e-4, -5e-4, 7e-4]), anomaly=np.ones(3), undulation=None,
                             altitude_msl=None)  # fmt: skip
    monkeypatch.setattr(gravity, "gravity_values", lambda motion: values)
    motion = Disturbed.__new__(Disturbed)
    assert len(list(gravity.gravity_plots(motion))) == 4
    plots[0].shows("Deflection of the vertical", "arcsec", ("ξ, north", ORANGE, time, [1.0, -2.0, 4.0]),
                   ("η, east", GREEN, time, [5.0, 7.0, -3.0]))  # fmt: skip
    plots[1].shows("Gravity beyond normal gravity", "mGal", ("gravity disturbance, down", BLUE, time,
                                                             [30.0, -50.0, 70.0]))  # fmt: skip
    assert [found.span for found in plots] == [(5.0, 8.0)] * 2
    assert not list(gravity.gravity_plots(SimpleNamespace()))  # type: ignore[arg-type]


def test_a_track_and_its_distance_from_the_samples(plots: Plots, monkeypatch: pytest.MonkeyPatch) -> None:
    fit = SimpleNamespace(warnings=("Too <fast>.",), notes=("One sample was left out.",))
    asked = []
    monkeypatch.setattr(track_source, "fit_lines", lambda one: [("largest speed", "12 m/s & more")])
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
    trajectory: Any = SimpleNamespace(channels=channels, start=6.5, end=9.5)
    html = "".join(track_source.track_source(scenario, trajectory))
    assert asked == ["earth"]
    assert cells(html) == [["recorded track", ""], ["made from", "a.csv"], ["vehicle", "land"],
                           ["largest speed", "12 m/s &amp; more"]]  # fmt: skip
    assert '<p class="broken">Too &lt;fast&gt;.</p>' in html
    assert "One sample was left out." in html
    distance, angle = plots
    distance.shows("Distance of the curve from the samples", "m", ("horizontal", GREEN, time, [1.0, 3.0, 2.0]),
                   ("vertical, up", BLUE, time, [-0.5, 0.25, 0.75]))  # fmt: skip
    angle.shows("Angle from the recorded attitude", "deg", ("angle", ORANGE, other, [0.5, -1.5]))
    assert distance.span == angle.span == (6.5, 9.5)
    section.waypoints = ("a",)
    assert "<h3>The planned route</h3>" in "".join(track_source.track_source(scenario, trajectory))
    assert len(plots) == 2
    scenario.track = None
    assert not list(track_source.track_source(scenario, trajectory))


def test_largest_errors_in_further_coordinates(monkeypatch: pytest.MonkeyPatch) -> None:
    """rad as seconds of arc, the units of lengths and speeds as they are; only the row's own case."""
    monkeypatch.setattr(coordinates, "labeller", lambda rows, pace: lambda row: f"engine {row.case}")
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
    monkeypatch.setitem(coordinates.COORDINATES, kind, "along & across")
    (head, note, listed) = coordinates.coordinate_tables(study, part, rows)
    assert "in the coordinates earth-fixed" in head
    assert "Along &amp; across. Computed minus true" in note
    assert cells(listed) == [
        ["motion", "", "x e, m", "vz e, m/s", "attitude, ″"],
        ["motion 3", "engine 3", "12.5", "0.0625", "40.0"], ["motion 4", "engine 4", "2.50", "0.500", "4.00"],
    ]  # fmt: skip
    part.coordinates = ("inertial",)
    monkeypatch.setitem(coordinates.COORDINATES, "inertial", "inertial axes")
    shown = cells(coordinates.coordinate_tables(study, part, rows)[2])
    assert shown == [["motion", "", "defect"], ["motion 5", "engine 5", "0.125"]]
    assert read(head)
