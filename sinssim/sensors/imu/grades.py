"""The grades of inertial measurement units: one row each of 1σ values, with their public source."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from sinssim.content import find_content, list_content
from sinssim.errors import InputError, nearest, shortened
from sinssim.sensors.imu.grade_file import SUFFIX, Grade, TriadGrade, read_grade
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, MPS_SQRT_H, PPM, UG

GRADE_TABLE: dict[str, Grade] = {
    "ideal": Grade(
        "ideal sensors without any errors",
        "none needed",
        gyro=TriadGrade(),
        accel=TriadGrade(),
    ),
    "laser-navigation": Grade(
        "best aircraft laser-gyro IMU, HG9900-like: 0.0035 deg/h, 25 µg",
        "Honeywell HG9900 brochure N61-1638-000-000, as tabulated by NavToolkit's hg9900_model: gyro bias 0.0035 "
        "deg/h, random walk 0.002 deg/√h, scale factor 5 ppm; accelerometer bias 25 µg, scale factor 100 ppm. The "
        "brochure lists no velocity random walk and no misalignment: 10 µg/√Hz and 2 arcsec are typical of the class.",
        gyro=TriadGrade(0.0035 * DEG_H, 5 * PPM, 2 * ARCSEC, 0.002 * DEG_SQRT_H),
        accel=TriadGrade(25 * UG, 100 * PPM, 2 * ARCSEC, 10 * UG),
    ),
    "laser-standard": Grade(
        "usual airliner laser-gyro IMU of the 1 nmi/h class: 0.01 deg/h, 50 µg",
        "the class, not one product: El-Sheimy and Youssef, Inertial sensors technologies for navigation "
        "applications, Satellite Navigation 1:2 (2020), table 1, navigation grade: 1 nmi/h, gyro drift under 0.01 "
        "deg/h, accelerometer bias under 100 µg. Random walks, scale factors and misalignment are typical of the "
        "class.",
        gyro=TriadGrade(0.01 * DEG_H, 10 * PPM, 5 * ARCSEC, 0.003 * DEG_SQRT_H),
        accel=TriadGrade(50 * UG, 50 * PPM, 5 * ARCSEC, 10 * UG),
    ),
    "tactical": Grade(
        "small laser-gyro IMU of guided weapons, HG1700-like: 1 deg/h, 1 mg",
        "Honeywell HG1700 brochure N61-1619-000-001, as tabulated by NavToolkit's hg1700_model: gyro bias 1 deg/h, "
        "random walk 0.125 deg/√h; accelerometer bias 1 mg, random walk 0.065 ft/s/√h = 0.02 m/s/√h. Scale factors "
        "(150 and 300 ppm) and misalignment are not in that tabulation and are typical of the class.",
        gyro=TriadGrade(1 * DEG_H, 150 * PPM, 100 * ARCSEC, 0.125 * DEG_SQRT_H),
        accel=TriadGrade(1000 * UG, 300 * PPM, 100 * ARCSEC, 0.02 * MPS_SQRT_H),
    ),
    "mems-tactical": Grade(
        "tactical MEMS IMU, STIM300-like: 0.5 deg/h, 0.75 mg",
        "Sensonor STIM300 data sheet revision 9, 10 g accelerometers, as tabulated by NavToolkit's stim300_model: "
        "gyro bias instability 0.5 deg/h (taken as the bias of a run), random walk 0.15 deg/√h, scale factor 500 "
        "ppm, misalignment 1 mrad; accelerometer bias on to off 0.75 mg, random walk 0.06 m/s/√h, scale factor 300 "
        "ppm, misalignment 1 mrad.",
        gyro=TriadGrade(0.5 * DEG_H, 500 * PPM, 1e-3, 0.15 * DEG_SQRT_H),
        accel=TriadGrade(750 * UG, 300 * PPM, 1e-3, 0.06 * MPS_SQRT_H),
    ),
    "mems-industrial": Grade(
        "industrial MEMS IMU, ADIS16465-like: 25 deg/h with an instability of 2 deg/h, 2 mg",
        "Analog Devices ADIS16465 data sheet, features: in-run bias stability 2 deg/h (-1 model), axis to axis "
        "misalignment 0.05 deg = 0.9 mrad; its random walk is 0.15 deg/√h where this grade has 0.1. Turn-on "
        "biases, velocity random walk and scale factors are typical of the class.",
        gyro=TriadGrade(25 * DEG_H, 1000 * PPM, 1e-3, 0.1 * DEG_SQRT_H, 2 * DEG_H),
        accel=TriadGrade(2000 * UG, 1000 * PPM, 1e-3, 0.1 * MPS_SQRT_H),
    ),
    "consumer": Grade(
        "MEMS chip of telephones and drones, ICM20602-like: 200 deg/h with an instability of 10 deg/h, 10 mg",
        "TDK InvenSense ICM-20602 data sheet DS-000176 revision 1.0: gyro sensitivity error 1 %, gyro noise 4 "
        "mdeg/s/√Hz = 0.24 deg/√h, accelerometer noise 100 µg/√Hz = 0.06 m/s/√h (this grade: 0.2 and 0.2). Biases "
        "(after a user's calibration), instability and misalignment are typical of the class.",
        gyro=TriadGrade(200 * DEG_H, 10000 * PPM, 10e-3, 0.2 * DEG_SQRT_H, 10 * DEG_H),
        accel=TriadGrade(10000 * UG, 10000 * PPM, 10e-3, 0.2 * MPS_SQRT_H),
    ),
}

GRADES: dict[str, str] = {name: grade.description for name, grade in GRADE_TABLE.items()}
"""The names of the grades of the table, each with a description."""


def find_grade(name: str) -> Grade:
    """Return one grade: of the table, of a real product, or of a user's file.

    Args:
        name: one of `GRADES`; the name of a file in the content folder `scenarios/grades`; or the path of a TOML file.

    Raises:
        InputError: there is no such grade, and the message lists the known ones; or its file has mistakes.
    """
    if name in GRADE_TABLE:
        return GRADE_TABLE[name]
    return read_grade(grade_file(name))


def grade_file(name: str) -> Path:
    """Return the file of a grade that is not in the table.

    Args:
        name: as for `find_grade`.

    Raises:
        InputError: there is no such grade.
    """
    return _file(name, Path.cwd())


@lru_cache(maxsize=64)
def _file(name: str, folder: Path) -> Path:
    """Return the file of a grade that is not in the table, seen from a folder."""
    if name.endswith(SUFFIX):
        file = folder / Path(name).expanduser()
        if not file.is_file():
            raise InputError(
                f"there is no grade file {shortened(name, 200)!r} in {folder}. A grade is a name from `sinssim list "
                "grades` or the path of a TOML file."
            )
        return file
    products = list_content("grades", packages=False)
    if name not in products:
        products = list_content("grades")
    if name not in products:
        near = nearest(name, [*GRADE_TABLE, *products])
        hint = f" Did you mean {near!r}?" if near else ""
        raise InputError(
            f"unknown IMU grade {shortened(repr(name))}.{hint} Known: {', '.join(sorted(GRADE_TABLE))}, and "
            f"{len(products)} products (`sinssim list grades`)."
        )
    return find_content("grades", name).resolve()


def grade_name(name: str) -> str:
    """Return the name of a grade for people.

    Args:
        name: as `imu.grade`.

    Returns:
        The name itself, or that of the file without its folder and ".toml".
    """
    return Path(name).stem if name.endswith(SUFFIX) else name
