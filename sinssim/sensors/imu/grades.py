"""Grades of inertial measurement units: TOML files of 1σ values by the keys of [imu], with their public source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, create_model

from sinssim.content import find_content, list_content
from sinssim.errors import InputError, nearest, shortened
from sinssim.sensors.imu.datasheet_lines import ErrorTable, to_si
from sinssim.sensors.imu.error_term import ErrorTerm
from sinssim.sensors.imu.error_term_table import TERMS
from sinssim.toml_mistakes import read_toml, validate
from sinssim.toml_section import Sentence
from sinssim.units import ARCSEC, DEG_H, DEG_SQRT_H, MPS_SQRT_H, PPM, UG

SUFFIX = ".toml"
"""End of the name of a grade's file; the names of other grades do not end so."""

_OF_THE_BLOCK = (
    *(f"{term.name}_{unit}" for term in TERMS if term.default is not None for unit in term.units),
    *("rate_hz", "sensor_set", "lever_arm_m", "mounting_deg", "temperature_start_c", "temperature_steady_c"),
    *("warm_up_time_s", "accel_arms_mm", "accel_delay_ms", "laser_gyro", "faults", "rotation"),
)

_Source = Annotated[str, Field(min_length=10, max_length=2000)]


@dataclass(frozen=True)
class TriadGrade:
    """The errors of the three gyros or of the three accelerometers of one grade, SI."""

    bias: float = 0.0  # 1σ of the turn-on bias, rad/s or m/s²
    scale: float = 0.0  # 1σ of the relative scale-factor error
    misalignment: float = 0.0  # 1σ of each of the six angles of the sensitive axes, rad
    random_walk: float = 0.0  # angle or velocity random walk N, rad/√s or m/s/√s
    instability: float = 0.0  # 1σ of the bias instability (first-order Gauss-Markov), rad/s or m/s²
    # 1σ or value of the other terms by their field of `TriadErrors`, SI
    others: Mapping[str, float] = field(default_factory=dict)

    def of(self, term: ErrorTerm) -> float:
        """Return the grade's 1σ of an error that differs from run to run, the value of any other, SI; the term's own
        value without any if the grade does not have it."""
        return float(getattr(self, term.field)) if term.field in _FIELDS else self.others.get(term.field, term.without)


_MAIN = ("bias", "scale", "misalignment", "random_walk")
"""Errors that every sensor has; a source that does not say them is told."""

_FIELDS = {item.name for item in fields(TriadGrade)} - {"others"}


@dataclass(frozen=True)
class Grade:
    """One row of the table, or one file."""

    description: str  # one sentence
    source: str  # the public documents with the figures, and the figures from elsewhere
    gyro: TriadGrade  # the three gyros
    accel: TriadGrade  # the three accelerometers


def of_grades(term: ErrorTerm) -> bool:
    """Return whether a grade's file can have an error term: not if its key in [imu] has a default of its own, which
    would hide the grade's value."""
    return term.default is None


def grade_key(term: ErrorTerm) -> str:
    """Return the key of an error term in a grade's file: that of the 1σ of an error that differs from run to run, the
    only key of any other."""
    return term.sigma_key if term.drawn else term.key


def _number(term: ErrorTerm) -> Any:
    limits = dict[str, Any](term.sigma_limits if term.drawn else term.limits or {"ge": 0.0})
    return Annotated[float, Field(**limits)] | None


_KEYS = {grade_key(term): (_number(term), Field(default=None)) for term in TERMS if of_grades(term)}
_Terms: Any = create_model("_Terms", __base__=ErrorTable, **dict[str, Any](_KEYS))


class _GradeFile(_Terms):  # type: ignore[misc]
    """A grade's file: a sentence, the source of its numbers, and the numbers by the keys of [imu]."""

    description: Sentence = Field(description="a sentence about the IMU, shown in lists and reports")
    source: _Source = Field(description="source of the values, for example a data sheet and its page")
    assumed: tuple[Sentence, ...] = ()

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Refuse keys of the sensor block."""
        for key in data:
            if key in _OF_THE_BLOCK:
                raise ValueError(f"{key} is not part of a grade: give it in the scenario's [imu]")
        normalized: dict[str, Any] = super().normalized(data)
        return normalized


def read_grade(file: Path) -> Grade:
    """Read a grade from a TOML file with `description`, `source`, optionally `assumed`, which lists what the source
    does not say, and error terms by the keys of [imu]: of an error that differs from run to run the 1σ. A term that the
    file does not have is zero."""
    try:
        stat = file.stat()
    except OSError:
        read_toml(file)  # its message says why
        raise
    return _read(file, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=64)
def _read(file: Path, _changed: int, _size: int) -> Grade:
    """Read a file once for each state of it, because every error term of every run asks for the grade."""
    text, data = read_toml(file)
    given = validate(_GradeFile, data, text, str(file))
    triads: dict[str, dict[str, float]] = {"gyro": {}, "accel": {}}
    for term in TERMS:
        value = getattr(given, grade_key(term), None)
        if value is not None:
            triads[term.triad][term.field] = to_si(grade_key(term), value)
    parts = [given.source.strip(), *(f"assumed: {sentence}" for sentence in given.assumed)]
    silent = [term.name for term in TERMS if term.field in _MAIN and term.field not in triads[term.triad]]
    if silent:
        parts.append(f"not given and therefore zero: {', '.join(silent)}")
    source = "; ".join(parts)
    return Grade(given.description, source, _triad(triads["gyro"]), _triad(triads["accel"]))


def _triad(values: Mapping[str, float]) -> TriadGrade:
    field_values = {name: value for name, value in values.items() if name in _FIELDS}
    return TriadGrade(**field_values, others={name: value for name, value in values.items() if name not in _FIELDS})


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
    """Return one grade: of the table, of a real product, or of a user's file. `name`: one of `GRADES`; the name of a
    file in the content folder `scenarios/grades`; or the path of a TOML file."""
    if name in GRADE_TABLE:
        return GRADE_TABLE[name]
    return read_grade(grade_file(name))


def _known(name: str) -> str:
    find_grade(name)
    return name


GradeName = Annotated[str, AfterValidator(_known)]
"""Name or file of a grade that can be used."""


def grade_file(name: str) -> Path:
    """Return the file of a grade that is not in the table. `name`: as for `find_grade`."""
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
    """Return the name of a grade for people: the name itself, or that of the file without its folder and ".toml".
    `name`: as `imu.grade`."""
    return Path(name).stem if name.endswith(SUFFIX) else name
