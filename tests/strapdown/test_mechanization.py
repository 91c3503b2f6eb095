"""The options of a navigator: every engine takes them alike, and each that would have no effect is refused."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, get_type_hints

import numpy as np
import pytest

from sinssim import navigate
from sinssim.errors import InputError
from sinssim.experiments.ensembles.batch_navigation import navigate_batch
from sinssim.sensors.imu.emulation import emulate
from sinssim.sensors.imu.imu_errors import ImuErrors
from sinssim.strapdown.mechanization import Mechanization, Options
from sinssim.strapdown.navigate import Segments
from sinssim.truth.motions.parked_and_great_circle import GreatCircle
from tests.experiments.ensembles.test_navigate_batch import drawn
from tests.slow import slow

FLIGHT = GreatCircle(0.7, 0.2, 4000.0, 0.6, 120.0, 20.0)


def test_the_options_by_name_are_the_fields() -> None:
    assert list(get_type_hints(Options)) == [field.name for field in fields(Mechanization)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"algorithm": "quaternio"}, "unknown algorithm 'quaternio'"),
        ({"frame": "leveled"}, "unknown frame 'leveled'"),
        ({"gravity": "j3"}, "unknown gravity model 'j3'"),
        ({"ellipsoid": "wgs85"}, "unknown ellipsoid 'wgs85'"),
        ({"curvature": "flat"}, "unknown curvature 'flat'"),
        ({"vertical": "loop"}, "unknown vertical channel 'loop'"),
        ({"slow_quantities": "keep"}, "unknown treatment of slow quantities 'keep'"),
        ({"azimuth": 0.3}, 'for the frames wander and free-azimuth; here frame = "level"'),
        ({"azimuth": float("nan"), "frame": "wander"}, "azimuth = nan"),
        ({"frame": "transverse", "azimuth": 0.3}, 'here frame = "transverse"'),
        ({"frame": "inertial", "curvature": "spherical"}, 'curvature = "spherical" would have no effect'),
        ({"route": (0.1, 0.2, 0.3, 0.4)}, 'route would have no effect: it is for frame = "transverse"'),
        ({"slow_quantities": "extrapolate"}, 'slow_quantities = "extrapolate" would have no effect'),
        (
            {"baro_time_constant": 20.0},
            'baro_time_constant = 20 would have no effect: it belongs to vertical = "b',
        ),
        ({"baro_time_constant": -20.0, "vertical": "baro-loop"}, "baro_time_constant = -20"),
        ({"rates_hz": (100.0, 30.0, 10.0)}, "the medium rate, 30 Hz, does not divide the fast rate"),
        ({"rates_hz": (100.0, 50.0, 10.0), "algorithm": "rotation-vector-2"}, "advances the attitude sample by sample"),
        ({"rates_hz": (100.0, 50.0, 10.0), "algorithm": "platform"}, "navigation on a platform has no fast part"),
        ({"rates_hz": (100.0, 10.0), "algorithm": "measured-attitude"}, "with a measured attitude cannot run at three"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as info:
        Mechanization(**options)
    assert message in str(info.value)


def test_two_rates_are_those_of_attitude_and_of_the_rest() -> None:
    assert Mechanization(rates_hz=(200, 50)).rates_hz == (200.0, 50.0, 50.0)


@pytest.mark.parametrize(
    "options",
    [
        {"ellipsoid": "krasovsky-1940"},
        # three kernels that nothing else compiles
        *slow({"gravity": "j2", "ellipsoid": "krasovsky-1940", "curvature": "simplified"}),
    ],
)
def test_the_engines_take_the_options_and_the_mechanization_alike(options: Any) -> None:
    imu, start = FLIGHT.increments(50.0), FLIGHT.state(0.0)
    of = Mechanization(**options)
    alone = navigate(imu, start, of)
    np.testing.assert_array_equal(navigate(imu, start, **options).latitude, alone.latitude)
    for engine in (Segments(imu, of), Segments(imu, **options)):
        _, samples = engine.samples(0, 1000)
        np.testing.assert_allclose(
            engine.navigate(0, 1000, start, samples).latitude, alone.latitude, rtol=0, atol=1e-14
        )
    # with these errors and this channel, a batch has the kernel of its own tests
    loop, height, errors = (
        {"vertical": "baro-loop"},
        np.full(len(imu.time), 4000.0),
        drawn("laser-standard in full", [1]),
    )
    single = navigate(emulate(imu, errors[0], 1, rounded=True), start, replace(of, **loop), height=height)
    for given in ({"mechanization": replace(of, **loop)}, {**options, **loop}):
        many = navigate_batch(imu, start, errors, [1], [1000], height=height, **given)
        np.testing.assert_allclose(many.latitude[0], single.latitude[1000:], rtol=0, atol=1e-14)
    assert abs(alone.latitude[-1] - navigate(imu, start).latitude[-1]) > 1e-10  # the options have an effect


def test_a_mechanization_and_options_exclude_each_other() -> None:
    imu, start = FLIGHT.increments(50.0), FLIGHT.state(0.0)
    with pytest.raises(InputError, match="frame: give a mechanization, or its options by name, not both"):
        navigate(imu, start, Mechanization(), frame="wander")
    with pytest.raises(InputError, match="a batch is navigated in the frame"):
        navigate_batch(imu, start, [ImuErrors()], [1], [1000], frame="wander")
    with pytest.raises(InputError, match="segments have a free vertical channel"):
        Segments(imu, Mechanization(frame="wander", azimuth=0.3))


def test_a_section_gives_its_values_in_si() -> None:
    from sinssim.scenario.navigation_section import NavigationSection

    section = NavigationSection(
        algorithms=("euler", "quaternion"), frame="transverse", gravity="j2", curvature="no-height",
        route_deg=(10.0, 20.0, 30.0, 40.0), vertical="baro-loop", baro_time_constant_s=35.0,
    )  # fmt: skip
    assert section.mechanization("quaternion", "pz-90.11") == Mechanization(
        algorithm="quaternion", frame="transverse", gravity="j2", ellipsoid="pz-90.11", curvature="no-height",
        route=(0.17453292519943295, 0.3490658503988659, 0.5235987755982988, 0.6981317007977318),
        vertical="baro-loop", baro_time_constant=35.0,
    )  # fmt: skip
    in_segments = section.in_segments("pz-90.11")
    assert (in_segments.algorithm, in_segments.vertical) == ("euler", "free")
    own = NavigationSection(frame="wander", azimuth_deg=-90.0, ellipsoid="krasovsky-1940")
    assert own.mechanization("quaternion", "pz-90.11").ellipsoid == "krasovsky-1940"
    assert own.mechanization("quaternion", "pz-90.11").azimuth == pytest.approx(-np.pi / 2, abs=1e-15)
