"""The grades of inertial measurement units: one row each of 1σ values, with their public source."""

from __future__ import annotations

from dataclasses import dataclass

from sinssim.errors import unknown_name
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, MPS_SQRT_H, PPM, UG


@dataclass(frozen=True)
class TriadGrade:
    """The errors of the three gyros or of the three accelerometers of one grade, SI.

    Attributes:
        bias: 1σ of the turn-on bias, rad/s or m/s².
        scale: 1σ of the relative scale-factor error.
        misalignment: 1σ of each of the six angles of the sensitive axes, rad.
        random_walk: angle or velocity random walk N, rad/√s or m/s/√s.
        instability: 1σ of the bias instability (first-order Gauss-Markov), rad/s or m/s².
    """

    bias: float = 0.0
    scale: float = 0.0
    misalignment: float = 0.0
    random_walk: float = 0.0
    instability: float = 0.0


@dataclass(frozen=True)
class Grade:
    """One row of the table.

    Attributes:
        description: one sentence.
        source: the public documents with the figures, and the figures from elsewhere.
        gyro: the three gyros.
        accel: the three accelerometers.
    """

    description: str
    source: str
    gyro: TriadGrade
    accel: TriadGrade


GRADE_TABLE: dict[str, Grade] = {
    "ideal": Grade(
        "no errors at all",
        "none needed",
        gyro=TriadGrade(),
        accel=TriadGrade(),
    ),
    "laser-navigation": Grade(
        "best aircraft laser-gyro unit, HG9900-like: 0.0035 deg/h, 25 µg",
        "Honeywell HG9900 brochure N61-1638-000-000, as tabulated by NavToolkit's hg9900_model: gyro bias 0.0035 "
        "deg/h, random walk 0.002 deg/√h, scale factor 5 ppm; accelerometer bias 25 µg, scale factor 100 ppm. The "
        "brochure lists no velocity random walk and no misalignment: 10 µg/√Hz and 2 arcsec are typical of the class.",
        gyro=TriadGrade(0.0035 * DEG_H, 5 * PPM, 2 * ARCSEC, 0.002 * DEG_SQRT_H),
        accel=TriadGrade(25 * UG, 100 * PPM, 2 * ARCSEC, 10 * UG),
    ),
    "laser-standard": Grade(
        "ordinary airliner laser-gyro unit of the 1 nmi/h class: 0.01 deg/h, 50 µg",
        "the class, not one product: El-Sheimy and Youssef, Inertial sensors technologies for navigation "
        "applications, Satellite Navigation 1:2 (2020), table 1, navigation grade: 1 nmi/h, gyro drift under 0.01 "
        "deg/h, accelerometer bias under 100 µg. Random walks, scale factors and misalignment are typical of the "
        "class.",
        gyro=TriadGrade(0.01 * DEG_H, 10 * PPM, 5 * ARCSEC, 0.003 * DEG_SQRT_H),
        accel=TriadGrade(50 * UG, 50 * PPM, 5 * ARCSEC, 10 * UG),
    ),
    "tactical": Grade(
        "small laser-gyro unit of guided weapons, HG1700-like: 1 deg/h, 1 mg",
        "Honeywell HG1700 brochure N61-1619-000-001, as tabulated by NavToolkit's hg1700_model: gyro bias 1 deg/h, "
        "random walk 0.125 deg/√h; accelerometer bias 1 mg, random walk 0.065 ft/s/√h = 0.02 m/s/√h. Scale factors "
        "(150 and 300 ppm) and misalignment are not in that tabulation and are typical of the class.",
        gyro=TriadGrade(1 * DEG_H, 150 * PPM, 100 * ARCSEC, 0.125 * DEG_SQRT_H),
        accel=TriadGrade(1000 * UG, 300 * PPM, 100 * ARCSEC, 0.02 * MPS_SQRT_H),
    ),
    "mems-tactical": Grade(
        "tactical MEMS unit, STIM300-like: 0.5 deg/h, 0.75 mg",
        "Sensonor STIM300 data sheet revision 9, 10 g accelerometers, as tabulated by NavToolkit's stim300_model: "
        "gyro bias instability 0.5 deg/h (taken as the bias of a run), random walk 0.15 deg/√h, scale factor 500 "
        "ppm, misalignment 1 mrad; accelerometer bias on to off 0.75 mg, random walk 0.06 m/s/√h, scale factor 300 "
        "ppm, misalignment 1 mrad.",
        gyro=TriadGrade(0.5 * DEG_H, 500 * PPM, 1e-3, 0.15 * DEG_SQRT_H),
        accel=TriadGrade(750 * UG, 300 * PPM, 1e-3, 0.06 * MPS_SQRT_H),
    ),
    "mems-industrial": Grade(
        "industrial MEMS unit, ADIS16465-like: 25 deg/h with an instability of 2 deg/h, 2 mg",
        "Analog Devices ADIS16465 data sheet, features: in-run bias stability 2 deg/h (-1 model), axis to axis "
        "misalignment 0.05 deg = 0.9 mrad; its random walk is 0.15 deg/√h where this grade has 0.1. Turn-on "
        "biases, velocity random walk and scale factors are typical of the class.",
        gyro=TriadGrade(25 * DEG_H, 1000 * PPM, 1e-3, 0.1 * DEG_SQRT_H, 2 * DEG_H),
        accel=TriadGrade(2000 * UG, 1000 * PPM, 1e-3, 0.1 * MPS_SQRT_H),
    ),
    "consumer": Grade(
        "telephone and drone MEMS chip, ICM20602-like: 200 deg/h with an instability of 10 deg/h, 10 mg",
        "TDK InvenSense ICM-20602 data sheet DS-000176 revision 1.0: gyro sensitivity error 1 %, gyro noise 4 "
        "mdeg/s/√Hz = 0.24 deg/√h, accelerometer noise 100 µg/√Hz = 0.06 m/s/√h (this grade: 0.2 and 0.2). Biases "
        "(after a user's calibration), instability and misalignment are typical of the class.",
        gyro=TriadGrade(200 * DEG_H, 10000 * PPM, 10e-3, 0.2 * DEG_SQRT_H, 10 * DEG_H),
        accel=TriadGrade(10000 * UG, 10000 * PPM, 10e-3, 0.2 * MPS_SQRT_H),
    ),
}

GRADES: dict[str, str] = {name: grade.description for name, grade in GRADE_TABLE.items()}
"""The names of the grades, each with a description."""


def find_grade(name: str) -> Grade:
    """Return one row of the table.

    Args:
        name: one of `GRADES`.

    Returns:
        The row.

    Raises:
        InputError: there is no such grade; the message lists the known grades.
    """
    if name not in GRADE_TABLE:
        raise unknown_name("IMU grade", name, GRADE_TABLE)
    return GRADE_TABLE[name]
