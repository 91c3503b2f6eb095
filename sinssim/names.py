"""The names by which a scenario chooses among the navigation engine's parts, each with a sentence for a person.

They stand apart from what they name, so that checking a scenario and listing the choices needs no compiler.
"""

from __future__ import annotations

from sinssim.algorithms import REGISTRY

ALGORITHMS: dict[str, str] = {name: algorithm.sentence for name, algorithm in REGISTRY.items()}

MEASURED_ATTITUDE = "measured-attitude"
"""What a scenario names as its algorithm where the attitude is measured and not computed."""

SCENARIO_ALGORITHMS: dict[str, str] = {
    **ALGORITHMS,
    MEASURED_ATTITUDE: "none: velocity and position by the attitude that imu.sensor_set measures, in inertial axes",
}
"""What a scenario may name as its algorithms."""

FRAMES: dict[str, str] = {
    "level": "local geodetic level with north orientation (north, east, down)",
    "wander": "local level whose azimuth does not turn relative to the Earth about the vertical; over the poles too",
    "free-azimuth": "local level whose azimuth does not turn in inertial space about the vertical; over the poles too",
    "transverse": "local level oriented along an orthodrome: spherical coordinates whose equator is the route",
    "inertial": "Earth-centred inertial, with geodetic output",
}

CURVATURES: dict[str, str] = {
    "exact": "radii of curvature of the ellipsoid",
    "simplified": "the chapter's first-order radii (8.16), in error by up to 4.5e-5",
}

VERTICALS: dict[str, str] = {
    "free": "pure inertial height, unstable: an error grows 277-fold in an hour",
    "baro-loop": "third-order loop to a height reference (baro-inertial)",
    "truth": "height and vertical velocity held to the height reference",
}

SLOW_QUANTITIES: dict[str, str] = {
    "hold": "what the slow part computed is held until it computes again",
    "extrapolate": "what the slow part computed is extrapolated linearly from its last two values",
}

FILTER_STATES: dict[str, str] = {
    "gyro bias": "constant errors of the gyros",
    "accelerometer bias": "constant errors of the accelerometers",
    "gyro scale": "scale-factor errors of the gyros",
    "accelerometer scale": "scale-factor errors of the accelerometers",
    "gyro misalignment": "tilts of the gyros' sensitive axes, six angles",
    "accelerometer misalignment": "tilts of the accelerometers' sensitive axes, six angles",
}
