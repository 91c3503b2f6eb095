"""The description of an aircraft.

Its JSBSim model, the place of the sensor block, the autopilot's gains, its envelope.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from sinssim.content import find_content
from sinssim.toml_mistakes import read_toml, validate
from sinssim.toml_section import NotNegative, Positive, Section
from sinssim.truth.motion import Mounting


class Performance(Section):
    """Usual speeds, limits and settings of the type."""

    cruise_kt: Positive  # usual airspeed, calibrated, kt
    glider: bool = False  # whether it has no engine: the airspeed is held by pitch, and the height falls
    stall_alpha_deg: Positive  # angle of attack above which the aircraft counts as stalled, degrees
    bank_deg: Positive  # usual angle of bank, degrees
    # limits of the load factor for the autopilot, g
    max_load_factor_g: Positive
    min_load_factor_g: float = Field(le=0.9)
    # usual vertical speeds, m/s; descent_mps of a glider is its rate of sink at cruise
    climb_mps: Positive
    descent_mps: Positive
    acceleration_mps2: Positive  # rate of change of airspeed, m/s²
    takes_off: bool = True  # whether it starts on a runway
    takeoff_kt: Positive  # airspeed of rotation, kt
    takeoff_pitch_deg: Positive  # pitch angle held from rotation, degrees
    initial_climb_kt: Positive  # airspeed of the climb after take-off, kt
    takeoff_flaps: float = Field(ge=0.0, le=1.0)  # flap setting for take-off, as a fraction of full travel
    # throttle setting for take-off, as a fraction of full travel
    takeoff_throttle: float = Field(default=1.0, gt=0.0, le=1.0)
    retractable_gear: bool  # whether the gear is retracted after take-off
    engine_start_s: NotNegative = 30.0  # usual time to start the engines, s
    taxi_mps: Positive = 6.0  # usual ground speed of taxiing, m/s
    approach_kt: Positive | None = None  # airspeed of the approach, kt; None: the aircraft cannot land
    # flap setting of the approach, as a fraction of full travel
    landing_flaps: float = Field(default=0.0, ge=0.0, le=1.0)
    standing_height_m: NotNegative = 1.5  # height of the centre of gravity above the ground of the standing aircraft, m
    # setting of the brakes of the roll-out, as a fraction of full travel
    braking: float = Field(default=0.3, gt=0.0, le=1.0)


class Envelope(Section):
    """What the model can do in steady flight, by `sinssim.truth.flight.jsbsim_model`."""

    height_m: tuple[float, ...] = Field(min_length=2)  # heights, m, increasing
    # slowest and fastest level flight at each height, calibrated, kt; 0: none
    min_kt: tuple[NotNegative, ...]
    max_kt: tuple[NotNegative, ...]
    airspeed_kt: tuple[Positive, ...] = Field(min_length=2)  # calibrated airspeeds, kt, increasing
    # largest rate of climb at a constant calibrated airspeed, rows by height and columns by airspeed, m/s; negative:
    # level flight is not possible
    climb_mps: tuple[tuple[float, ...], ...]
    # largest rate of descent with idle engines at a constant calibrated airspeed, m/s
    descent_mps: tuple[tuple[float, ...], ...]

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        rows, columns = len(self.height_m), len(self.airspeed_kt)
        for key in ("min_kt", "max_kt", "climb_mps", "descent_mps"):
            if len(getattr(self, key)) != rows:
                raise ValueError(f"{key} needs {rows} entries, one for each height_m")
        for key in ("climb_mps", "descent_mps"):
            if any(len(row) != columns for row in getattr(self, key)):
                raise ValueError(f"each row of {key} needs {columns} values, one for each airspeed_kt")
        for key in ("height_m", "airspeed_kt"):
            if any(b <= a for a, b in pairwise(getattr(self, key))):
                raise ValueError(f"the values of {key} must increase")
        return self


class AutopilotGains(Section):
    """Gains of our autopilot; control deflections as a fraction of full travel, angles in rad, rates in rad/s."""

    reference_kt: Positive  # airspeed at which the gains hold, kt
    # whether feedback decreases with dynamic pressure and feedforward with airspeed (a conventional control system);
    # false: gains are the same at any airspeed (a control system that commands rates)
    airspeed_scheduled: bool
    # limits of the bank reference
    roll_rate_max_deg_s: Positive
    roll_acceleration_max_deg_s2: Positive
    bank_rate: Positive  # bank error to bank rate, of the reference, 1/s
    bank_gain: Positive  # bank error against the reference to roll rate, 1/s
    # roll rate, its error and the error's integral to aileron
    roll_feedforward: NotNegative
    roll_gain: NotNegative
    roll_integral: NotNegative
    heading_time_s: Positive  # time constant of a heading error
    height_rate: Positive  # height error to vertical speed, 1/s
    path_gain: Positive  # vertical-speed error to vertical acceleration, 1/s
    vertical_acceleration_mps2: Positive  # limit of the vertical-speed reference
    load_time_s: Positive  # time constant of the load-factor reference
    lift_time_s: NotNegative  # lag of the lift behind the pitch rate at the reference airspeed at sea level
    # pitch rate, its error and its integral to elevator
    pitch_feedforward: NotNegative
    pitch_gain: NotNegative
    pitch_integral: NotNegative
    # airspeed error (m/s) and its integral to throttle
    speed_gain: Positive
    speed_integral: NotNegative
    climb_throttle: NotNegative  # climb angle to throttle
    throttle_lead_s: NotNegative = 0.0  # lead of the climb's throttle, against the lag of the engines
    throttle_rate: Positive  # limit of the throttle's rate, 1/s
    # yaw rate of the coordinated turn to rudder, against a yaw damper that would resist it
    yaw_feedforward: NotNegative
    yaw_gain: NotNegative  # yaw-rate error against the coordinated turn to rudder
    # sideslip and its integral to rudder
    sideslip_gain: NotNegative
    sideslip_integral: NotNegative
    steering_gain: NotNegative  # heading error on the ground to nose-wheel steering


class Aircraft(Section):
    """One aircraft: the contents of its aircraft.toml."""

    description: str
    jsbsim_model: str  # the flight dynamics model: one of JSBSim's own, or a folder beside aircraft.toml
    # new text for elements of the model's XML, by XPath, applied when the model is loaded; an element with an empty new
    # text is removed
    model_changes: dict[str, str] = Field(default_factory=dict)
    mounting: Mounting  # place of the sensor block
    performance: Performance  # usual speeds, limits and settings of the type
    autopilot: AutopilotGains  # gains of our autopilot
    # what the model can do in steady flight; None: `sinssim check` does not know its limits
    envelope: Envelope | None = None


def aircraft_exists(name: str) -> str:
    """Return the name of an aircraft, or the path of its folder or its aircraft.toml, if it exists."""
    find_content("aircraft", name)
    return name


def load_aircraft(name: str) -> Aircraft:
    """Read the description of an aircraft by its name, or by the path of its folder or its aircraft.toml."""
    file = find_content("aircraft", name)
    try:
        about = file.stat()
    except OSError:
        return _read.__wrapped__(file, 0, 0)  # its error names the file
    return _read(file, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=16)
def _read(file: Path, modified: int, size: int) -> Aircraft:
    """Read a file; it is read again when it has changed."""
    text, data = read_toml(file)
    return validate(Aircraft, data, text, str(file))


SERVICE_CLIMB = 0.5
"""Rate of climb that is left at the service ceiling: 100 ft/min [m/s]."""


def _between(at: Sequence[float], value: float) -> tuple[int, float]:
    """Return the point below a value and the share of the way to the next one, 0 … 1."""
    row = max(0, min(len(at) - 2, bisect_right(at, value) - 1))
    return row, max(0.0, min(1.0, (value - at[row]) / (at[row + 1] - at[row])))


def _of_table(envelope: Envelope, table: Sequence[Sequence[float]], height: float, speed_kt: float) -> float:
    row, up = _between(envelope.height_m, height)
    column, on = _between(envelope.airspeed_kt, speed_kt)
    (a, b), (c, d) = table[row][column : column + 2], table[row + 1][column : column + 2]
    return (1.0 - up) * ((1.0 - on) * a + on * b) + up * ((1.0 - on) * c + on * d)


def climb_rate(envelope: Envelope, height: float, speed_kt: float) -> float:
    """Return the largest steady rate of climb, m/s, at an airspeed and a height; negative above the ceiling."""
    return _of_table(envelope, envelope.climb_mps, height, speed_kt)


def descent_rate(envelope: Envelope, height: float, speed_kt: float) -> float:
    """Return the largest steady rate of descent without more speed, m/s, engines idle."""
    return _of_table(envelope, envelope.descent_mps, height, speed_kt)


def speed_range(envelope: Envelope, height: float) -> tuple[float, float]:
    """Return the slowest and the fastest level flight at a height, kt; both 0 where there is no level flight."""
    row, up = _between(envelope.height_m, height)
    if not envelope.max_kt[row] or (up > 0.0 and not envelope.max_kt[row + 1]):
        row, up = (row, 0.0) if up < 0.5 else (row + 1, 0.0)
    (slow, fast) = envelope.min_kt[row], envelope.max_kt[row]
    if up > 0.0:
        slow += up * (envelope.min_kt[row + 1] - slow)
        fast += up * (envelope.max_kt[row + 1] - fast)
    return slow, fast


def ceiling(envelope: Envelope, speed_kt: float, rate: float = SERVICE_CLIMB) -> float:
    """Return the height at which a rate of climb is left, m; the largest of the envelope if more is left there."""
    low, high = envelope.height_m[0], envelope.height_m[-1]
    if climb_rate(envelope, high, speed_kt) >= rate:
        return high
    steps = 200
    for step in range(1, steps + 1):
        height = low + (high - low) * step / steps
        if climb_rate(envelope, height, speed_kt) < rate:
            return low + (high - low) * (step - 1) / steps
    return high


def best_ceiling(envelope: Envelope) -> tuple[float, float]:
    """Return the highest ceiling of all airspeeds, m, and its airspeed, kt."""
    return max((ceiling(envelope, speed), speed) for speed in envelope.airspeed_kt)
