"""Residuals and H of every kind of measurement, against readings made from the truth in Earth-fixed axes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sinssim.data import Array, Measurements, NavState
from sinssim.earth.ellipsoids import WGS84
from sinssim.estimation import BLOCKS, Block, ErrorModel
from sinssim.estimation.linearisation import Prediction, observe
from sinssim.sensors.aiding_registry import KINDS, measurement_kind
from sinssim.sensors.measurement_kind import skew
from tests.oracles import integrator as oracle

ARM = np.array([1.5, -0.4, -2.0])
RATE = np.array([0.05, -0.3, 0.2])  # inertial, in body axes
VELOCITY = np.array([120.0, -80.0, 6.0])
PLACE = (0.8, -2.0, 7000.0)
EULER = (1.1, 0.2, -0.5)  # heading, pitch, roll
OMEGA_E = np.array([0.0, 0.0, 7.292115e-5])

COMPONENTS = {"heading": 1, "speed": 1, "airspeed": 1, "baro-height": 1, "land-velocity": 2, "baseline-heading": 1}

MOUNTED = np.array([0.12, -0.2])  # assumed pitch and yaw of a land vehicle's axes in the block's

EXTRA = {
    "heading": {"deviation": (0.02, -0.03)},
    "airspeed": {"wind": (2.0, -3.0)},
    "land-velocity": {"mounting": (0.02, -0.03), "lever arm": (0.3, -0.2, 0.1), "slip": (0.005,)},
}
"""What else a kind may have, with a value of each state."""


def test_products_with_vectors_as_matrices() -> None:
    v, w = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, 7.0]]), np.array([0.3, -2.0, 5.0])
    np.testing.assert_allclose(skew(v) @ w, np.cross(v, w), rtol=1e-15)
    np.testing.assert_array_equal(skew(v[0]), skew(v)[0])


def model_of(kind: str) -> ErrorModel:
    count = COMPONENTS.get(kind, 3)
    own = [Block(f"{kind} bias", np.ones(count))]
    own += [Block(f"{kind} scale", 1.0)] if kind in ("baro-height", "speed", "airspeed") else []
    own += [Block(f"{kind} {name}", np.ones(len(value))) for name, value in EXTRA.get(kind, {}).items()]
    return ErrorModel((*(Block(name, 1.0) for name in BLOCKS), *own), 0.0, 0.0)


def reading(kind: str, arm: Array, bias: Array, scale: float, extra: dict[str, Array]) -> Array:
    """Return what a sensor with these errors reads of the truth, all in Earth-fixed axes."""
    position = oracle.geodetic_to_ecef(*PLACE)
    c_en = oracle.ned_axes(PLACE[0], PLACE[1]).T
    c_nb = Rotation.from_euler("ZYX", EULER).as_matrix()
    c_eb = c_en @ c_nb
    turning = RATE - c_eb.T @ OMEGA_E
    if kind == "land-velocity":
        arm = arm + extra["lever arm"]
    velocity = c_en @ VELOCITY + c_eb @ np.cross(turning, arm)
    if kind == "gnss-position":
        lat, lon, height = geodetic(position + c_eb @ arm)
        north, east = metres(lat, height)
        return np.array([lat + bias[0] / north, lon + bias[1] / east, height - bias[2]])
    if kind == "attitude":
        turned = Rotation.from_matrix(c_nb) * Rotation.from_rotvec(bias)
        return turned.as_quat(scalar_first=True)
    if kind == "earth-attitude":
        turned = Rotation.from_matrix(c_eb) * Rotation.from_rotvec(bias)
        return turned.as_quat(scalar_first=True)
    if kind == "land-velocity":
        pitch, yaw = MOUNTED + extra["mounting"]
        c_vb = Rotation.from_euler("ZYX", (yaw, pitch, 0.0)).as_matrix().T
        forward, right, down = c_vb @ c_eb.T @ velocity
        drift = -extra["slip"][0] * forward**2 * (c_vb @ turning)[2]
        return np.concatenate([(right - drift + bias[0], down + bias[1]), MOUNTED])
    if kind == "baseline-heading":
        line = c_nb @ arm
        return np.array([np.arctan2(line[1], line[0])]) + bias
    if kind == "heading":
        a, b = extra["deviation"]
        return np.array([EULER[0] + a * np.sin(EULER[0]) + b * np.cos(EULER[0])]) + bias
    if kind == "airspeed":
        through = np.linalg.norm(c_en.T @ velocity - np.append(extra["wind"], 0.0))
        return np.array([(1.0 + scale) * through]) + bias
    truth = {
        "gnss-velocity": c_en.T @ velocity,
        "zero-velocity": VELOCITY,
        "zero-rate": turning,
        "baro-height": np.array([PLACE[2]]),
        "speed": (c_eb.T @ velocity)[:1],
    }[kind]
    return (1.0 + scale) * truth + bias


def metres(lat: float, height: float) -> tuple[float, float]:
    """Return metres per radian of latitude and longitude."""
    w = 1.0 - oracle.F * (2.0 - oracle.F) * np.sin(lat) ** 2
    radius = oracle.A / np.sqrt(w)
    return radius * (1.0 - oracle.F) ** 2 / w + height, (radius + height) * np.cos(lat)


def geodetic(position: Array) -> tuple[float, float, float]:
    """Return latitude, longitude, height by iteration from the first place."""
    lat, lon, height = PLACE
    for _ in range(6):
        off = oracle.ned_axes(lat, lon) @ (position - oracle.geodetic_to_ecef(lat, lon, height))
        north, east = metres(lat, height)
        lat, lon, height = lat + off[0] / north, lon + off[1] / east, height - off[2]
    return lat, lon, height


def residual(kind: str, model: ErrorModel, x: Array) -> tuple[Array, Array]:
    """Return residual and H where navigation and the sensors' parameters are wrong by x."""
    part = {name: x[where] for name, where in model.slices.items()}
    north, east = metres(PLACE[0], PLACE[2])
    p, c_nb = part["position"], Rotation.from_rotvec(-part["attitude"]) * Rotation.from_euler("ZYX", EULER)
    state = NavState(
        np.array([PLACE[0] + p[0] / north]),
        np.array([PLACE[1] + p[1] / east]),
        np.array([PLACE[2] - p[2]]),
        (VELOCITY + part["velocity"])[None],
        c_nb.as_quat(scalar_first=True)[None],
    )
    angles = np.zeros((3, 3))
    angles[~np.eye(3, dtype=bool)] = part["gyro misalignment"]
    constant = part["gyro bias"] + part["gyro instability"] + sum(part[f"gyro flicker {k}"] for k in range(1, 10))
    wrong = constant + part["gyro scale"] * RATE + angles @ RATE
    wrong += 0.5 * part["gyro asymmetry"] * np.abs(RATE) + part["gyro quadratic"] * RATE**2
    wrong += part["gyro cubic"] * RATE**3
    up = -9.80665 * Rotation.from_euler("ZYX", EULER).as_matrix()[2]  # the specific force without acceleration
    wrong += part["gyro g-sensitivity"].reshape(3, 3) @ up
    of_gnss = kind in ("gnss-position", "gnss-velocity")
    true_arm = ARM + part["gnss lever arm"] if of_gnss else ARM
    scale = part[f"{kind} scale"][0] if f"{kind} scale" in part else 0.0
    extra = {name: part[f"{kind} {name}"] for name in EXTRA.get(kind, {})}
    value = reading(kind, true_arm, part[f"{kind} bias"], scale, extra)[None]
    measurements = Measurements(kind, np.zeros(1), np.zeros(1), value, np.ones((1, measurement_kind(kind).errors)), ARM)
    known = {block.name: np.zeros(block.size) for block in model.blocks[3:]}
    y, h = observe(measurements, Prediction(state, (RATE + wrong)[None], WGS84), model, known)
    return y[0], h[0]


STEPS = {
    "position": 100.0,
    "attitude": 5e-4,
    "velocity": 0.02,
    "gnss lever arm": 0.1,
    "baro-height bias": 1.0,
    "gnss-position bias": 1.0,
}


@pytest.mark.parametrize("kind", KINDS)
def test_h_is_the_derivative_of_the_residual(kind: str) -> None:
    model = model_of(kind)
    at_truth, h = residual(kind, model, np.zeros(model.size))
    np.testing.assert_allclose(at_truth, 0.0, atol=2e-9)  # rounding of positions on the Earth
    for name, where in model.slices.items():
        step = STEPS.get(name, 1e-4)
        for j in range(where.start, where.stop):
            x = np.zeros(model.size)
            x[j] = 4.0 * step
            # of fourth order: the steps are large beside the rounding of positions on the Earth
            near = residual(kind, model, x)[0] - residual(kind, model, -x)[0]
            far = residual(kind, model, 2.0 * x)[0] - residual(kind, model, -2.0 * x)[0]
            slope = (8.0 * near - far) / (48.0 * step)
            assert np.abs(slope - h[:, j]).max() < 1e-6 * max(np.abs(h[:, where]).max(), 1e-5 / step), (name, j)


def test_the_known_part_of_a_sensors_errors_is_taken_off() -> None:
    for kind in KINDS:
        model = model_of(kind)
        x = np.zeros(model.size)
        x[model.slices[f"{kind} bias"]] = 0.01
        if f"{kind} scale" in model.slices:
            x[model.slices[f"{kind} scale"]] = 1e-3
        extra = {name: np.array(value) for name, value in EXTRA.get(kind, {}).items()}
        for name, value in extra.items():
            x[model.slices[f"{kind} {name}"]] = value
        scale = 1e-3 if f"{kind} scale" in model.slices else 0.0
        given = reading(kind, ARM, x[model.slices[f"{kind} bias"]], scale, extra)
        c_nb = Rotation.from_euler("ZYX", EULER).as_quat(scalar_first=True)
        state = NavState(*(np.array([v]) for v in PLACE), VELOCITY[None], c_nb[None])
        m = Measurements(kind, np.zeros(1), np.zeros(1), given[None], np.ones((1, measurement_kind(kind).errors)), ARM)
        known = {block.name: x[model.slices[block.name]] for block in model.blocks[3:]}
        y, _ = observe(m, Prediction(state, RATE[None], WGS84), model, known)
        np.testing.assert_allclose(y, 0.0, atol=2e-8)


@pytest.mark.parametrize("kind", ["baro-height", "speed", "airspeed"])
def test_a_large_scale_factor_is_linear(kind: str) -> None:
    """(1 + k) z + b + ν is linear in k, b and ν for a known z, from any compensated k: here 10 %, with 4 % of it known.

    A residual of readings over 1 + k was off by h k², 15 m of 1500 m, and its noise was 10 % smaller than assumed.
    """
    model = model_of(kind)
    extra = {name: np.array(value) for name, value in EXTRA.get(kind, {}).items()}
    c_nb = Rotation.from_euler("ZYX", EULER).as_quat(scalar_first=True)
    state = NavState(*(np.array([v]) for v in PLACE), VELOCITY[None], c_nb[None])
    known = {block.name: np.zeros(block.size) for block in model.blocks[3:]}
    known.update({f"{kind} {name}": value for name, value in extra.items()})
    known[f"{kind} scale"], known[f"{kind} bias"] = np.array([0.04]), np.array([0.5])
    given = reading(kind, ARM, np.array([0.7]), 0.1, extra)
    x = np.zeros(model.size)
    x[model.slices[f"{kind} scale"]], x[model.slices[f"{kind} bias"]] = 0.06, 0.2
    for noise in (0.0, 1.0):
        m = Measurements(kind, np.zeros(1), np.zeros(1), given[None] + noise, np.ones((1, 1)), ARM)
        y, h = observe(m, Prediction(state, RATE[None], WGS84), model, known)
        np.testing.assert_allclose(y[0], h[0] @ x - noise, rtol=0.0, atol=1e-8)


def test_components_of_each_kind() -> None:
    """A quaternion has four numbers and three errors; a constraint of two errors comes with the vehicle's two angles;
    the other vectors have three of both, and the rest one."""
    vectors = {"gnss-position", "gnss-velocity", "zero-velocity", "zero-rate"}
    for name in KINDS:
        kind = measurement_kind(name)
        expected = (4, 3) if name.endswith("attitude") else (3, 3) if name in vectors else (1, 1)
        expected = (4, 2) if name == "land-velocity" else expected
        assert (kind.components, kind.errors) == expected, name


def row(
    columns: str, axes: str, unit: str, rounding: str | None = None, flags: str = "", velocities: int = 0
) -> dict[str, object]:
    names = ("mean_rate", "needs_rate", "at_antenna", "on_gnss_clock", "of_north", "same_in_all_axes")
    return {
        "columns": tuple(columns.split()), "axes": tuple(axes.split()) or ("",), "unit": unit, "rounding": rounding,
        "velocities": velocities, "flags": {name for name in names if name in flags.split()},
    }  # fmt: skip


VELOCITY_COLUMNS = "velocity_n_mps velocity_e_mps velocity_d_mps"
EXPECTED = {
    "gnss-position": row("latitude_rad longitude_rad height_m", "n e d", "m", None,
                         "at_antenna on_gnss_clock same_in_all_axes"),
    "gnss-velocity": row(VELOCITY_COLUMNS, "n e d", "mps", "accelerometers", "at_antenna on_gnss_clock of_north", 3),
    "baro-height": row("height_m", "", "m"),
    "zero-velocity": row(VELOCITY_COLUMNS, "n e d", "mps", "accelerometers", "same_in_all_axes", 3),
    "zero-rate": row("rate_x_radps rate_y_radps rate_z_radps", "x y z", "radps", None, "mean_rate", 3),
    "heading": row("heading_rad", "", "rad", "gyros", "of_north"),
    "baseline-heading": row("heading_rad", "", "rad", "gyros", "on_gnss_clock of_north"),
    "attitude": row("q_nb_w q_nb_x q_nb_y q_nb_z", "x y z", "rad", "gyros", "of_north"),
    "earth-attitude": row("q_eb_w q_eb_x q_eb_y q_eb_z", "x y z", "rad", "gyros"),
    "speed": row("speed_mps", "", "mps", "accelerometers", "", 1),
    "airspeed": row("airspeed_mps", "", "mps", "accelerometers", "of_north"),
    "land-velocity": row("velocity_right_mps velocity_down_mps pitch_rad yaw_rad", "right down", "mps",
                         "accelerometers", "needs_rate", 2),
}  # fmt: skip
"""Columns and units of the streams; which sensors' rounding is in a prediction; what a reading depends on."""


@pytest.mark.parametrize("name", KINDS)
def test_what_each_kind_says_of_itself(name: str) -> None:
    kind, expected = measurement_kind(name), EXPECTED[name]
    flags = {
        flag for flag in ("mean_rate", "needs_rate", "at_antenna", "on_gnss_clock", "of_north") if getattr(kind, flag)
    }
    flags |= set() if kind.turns_with_north else {"same_in_all_axes"}
    found = {own: getattr(kind, own) for own in ("columns", "axes", "unit", "rounding", "velocities")}
    assert {**found, "flags": flags} == expected
    model = ErrorModel((Block("position", 1.0), Block("velocity", 1.0), Block("attitude", 1.0)), 3e-4, 5e-3, 6e-5, 6e-3)
    noise = kind.noise(model, np.array([0.5, 2.0]))
    pulse = {"gyros": 6e-5, "accelerometers": 6e-3, None: 0.0}[expected["rounding"]]  # type: ignore[index]
    variance = np.full(2, pulse**2 / 12.0)  # a pulse rounds evenly
    if name == "zero-rate":  # N²/T, and rounding at both ends of the mean
        variance = np.array([9e-8 / 0.5 + 2.0 * 3.6e-9 / 12.0 / 0.25, 9e-8 / 2.0 + 2.0 * 3.6e-9 / 12.0 / 4.0])
    np.testing.assert_allclose(noise, variance, rtol=1e-12)


def test_own_errors_and_what_a_diagnosis_tries() -> None:
    own = {name: dict(measurement_kind(name).own_errors) for name in KINDS if measurement_kind(name).own_errors}
    assert own == {
        "heading": {"deviation": (("sin", "cos"), "rad")},
        "airspeed": {"wind": (("n", "e"), "mps")},
        "land-velocity": {
            "mounting": (("pitch", "yaw"), "rad"), "lever arm": (("forward", "right", "down"), "m"),
            "slip": (("",), "rad_per_mps2"),
        },
    }  # fmt: skip
    diagnosed = {name: dict(measurement_kind(name).diagnosed) for name in KINDS if measurement_kind(name).diagnosed}
    assert diagnosed == {
        "attitude": {"bias": 0.5}, "earth-attitude": {"bias": 0.5}, "baro-height": {"bias": 1000.0, "scale": 0.3},
        "speed": {"scale": 0.3}, "airspeed": {"bias": 30.0, "scale": 0.3, "wind": 30.0}, "heading": {"bias": 1.0},
        "baseline-heading": {"bias": 1.0}, "land-velocity": {"mounting": 0.3, "lever arm": 3.0},
    }  # fmt: skip


def test_a_latitude_in_degrees_is_a_fault() -> None:
    kind = measurement_kind("gnss-position")
    beyond = "a latitude beyond a pole (radians are expected)"
    assert [kind.fault(np.array([x, 3.0, 100.0])) for x in (1.57, -1.57, 1.58, -1.58)] == ["", "", beyond, beyond]
