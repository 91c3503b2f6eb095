"""The base class of every table of a scenario file, and value types that several tables share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import AfterValidator, ConfigDict, Field, ValidationError, model_validator

from sinssim.data import described
from sinssim.errors import InputError, unknown_name
from sinssim.toml_mistakes import Table, report
from sinssim.units import listed


def _tuples(value: Any) -> Any:
    """Convert lists to tuples at any depth, because a frozen model must not contain mutable values."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


class _Words(str):
    """Text whose `repr` is itself."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class Keys(NamedTuple):
    """Keys of a table that are alternatives, and what they give or what needs them, for messages."""

    names: tuple[str, ...]
    what: str


Rules = tuple[tuple[Callable[[Any], object], str], ...]


class Section(Table):
    """One table of a scenario file: immutable, without unknown keys, type conversions, NaN or infinity."""

    exactly_one: ClassVar[tuple[Keys, ...]] = ()
    """Keys of which one is given, and not another."""
    at_most_one: ClassVar[tuple[Keys, ...]] = ()
    """Keys that exclude each other."""
    paired: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Pairs of keys of which neither has a meaning without the other."""
    rules: ClassVar[Rules] = ()
    """Other keys that need or exclude each other, in the order in which mistakes are reported: a function that returns
    something true, `it`, if the table is wrong, and the message, of `it` and of the table `s`."""

    def __init__(self, /, *unnamed: object, **data: Any) -> None:
        """Check values like those of a scenario file; an `InputError` names the mistakes."""
        if unnamed:
            raise InputError(f"{type(self).__name__} takes its values by name, for example {self._example()}.")
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InputError(report(error, type(self), {}, (), type(self).__name__)) from error

    # pydantic then makes nested tables itself and gives the full path of a mistake in them
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def __repr_args__(self) -> Iterator[tuple[str, str]]:
        """Yield the keys that were given, each in a few words; a table has a hundred more with their defaults."""
        for name in type(self).model_fields:
            if name in self.model_fields_set and (value := getattr(self, name)) is not None:
                yield name, _Words(described(value))

    def __str__(self) -> str:
        return repr(self)

    @classmethod
    def _example(cls) -> str:
        return f"{cls.__name__}({next(iter(cls.model_fields), '')}=…)"

    # built when it is first used: a table is a part of larger ones, which build it again
    model_config = ConfigDict(
        defer_build=True, frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True
    )

    @model_validator(mode="before")
    @classmethod
    def _as_fields(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        data = cls.normalized(data)
        return {cls._own_key(key, data): _tuples(value) for key, value in data.items()}

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Return the contents with what stands for keys replaced by them: other units, the name of a file, defaults
        that depend on other keys. This happens before the fields are checked."""
        return data

    @classmethod
    def _own_key(cls, key: Any, data: dict[Any, Any]) -> Any:
        """Return the key that a table has for a given one: height_m is also the altitude_m of tables that have it."""
        field = f"altitude_{key.removeprefix('height_')}" if isinstance(key, str) and key.startswith("height_") else key
        if field == key or key in cls.model_fields or field not in cls.model_fields:
            return key
        if field in data:
            raise ValueError(f"{key} and {field} are one quantity: keep one of them")
        return field

    def model_post_init(self, context: Any, /) -> None:
        """Raise for keys that do not fit together."""

        def given(keys: tuple[str, ...]) -> list[str]:
            return [key for key in keys if getattr(self, key) not in (None, ())]

        for keys, what in self.exactly_one:
            if len(here := given(keys)) != 1:
                raise ValueError(f"{what}: give exactly one of them; here {_are(here)}")
        for keys, what in self.at_most_one:
            if len(here := given(keys)) > 1:
                raise ValueError(f"{listed(here)} both give {what}: remove one of them")
        for keys in self.paired:
            if len(here := given(keys)) == 1:
                raise ValueError(f"{listed(keys)} belong together: give both or neither; here {_are(here)}")
        for wrong, message in self.rules:
            if it := wrong(self):
                raise ValueError(message.format(it=it, s=self))

    def changed(self, *names: str) -> str:
        """Return the first of some keys that differs from its default, "" if none does."""
        fields = type(self).model_fields
        return next((name for name in names if getattr(self, name) != fields[name].default), "")


def _are(keys: list[str]) -> str:
    return f"{listed(keys)} {'is' if len(keys) == 1 else 'are'} given" if keys else "none is given"


def once(what: str, by: Callable[[Any], Any] = lambda entry: entry) -> AfterValidator:
    """Return the check of an array whose entries differ (what differs, for example "algorithm")."""

    def check(entries: tuple[Any, ...]) -> tuple[Any, ...]:
        known = [by(entry) for entry in entries]
        for value in known:
            if (count := known.count(value)) > 1:
                raise ValueError(f"{value!r} stands {count} times; give each {what} once")
        return entries

    return AfterValidator(check)


class Source(Section):
    """A table that says what is navigated: a true motion, or recorded sensors. A scenario has exactly one."""

    table: ClassVar[str]
    """Its name in the scenario."""
    travels: ClassVar[bool] = False
    """Whether the vehicle leaves its place; the default height channel is then the baro loop."""
    leaves_air: ClassVar[bool] = False
    """Whether it leaves the atmosphere, so that nothing that senses the air has a meaning."""
    recorded: ClassVar[bool] = False
    """Whether the sensors are recorded, not simulated."""
    in_space: ClassVar[bool] = True
    """Whether the tables of a run in three dimensions apply: sensors, aiding, navigation, filter."""
    idle: ClassVar[Mapping[str, str]] = {}
    """Tables that would have no effect beside this one, with the reason."""

    @property
    def has_readings(self) -> bool:
        """Whether it brings readings of aiding sensors."""
        return False

    @property
    def known_duration(self) -> float | None:
        """Duration, s, if a key of the table says it."""
        return getattr(self, "duration_s", None)


def known_name(kind: str, names: Iterable[str]) -> Callable[[str], str]:
    """Return a validator that accepts only the given names and otherwise lists them."""

    def check(value: str) -> str:
        if value not in names:
            raise unknown_name(kind, value, names)
        return value

    return check


def _a_turn(angle: float) -> float:
    if angle == 0.0:
        raise ValueError("0 is no turn; give, for example, 90 or -90")
    return angle


A_TURN = AfterValidator(_a_turn)
"""Check of the angle of a turn."""

Latitude = Annotated[float, Field(ge=-90.0, le=90.0)]
"""Geodetic latitude, degrees north."""

Longitude = Annotated[float, Field(ge=-180.0, le=360.0)]
"""Longitude, degrees east."""

Heading = Annotated[float, Field(ge=-360.0, le=360.0)]
"""Heading or course, degrees clockwise from north."""

# File names have at most 255 bytes, a letter up to four, and "-interrupted" may follow.
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][\w.-]*$", max_length=60)]
"""Short name of a scenario or study, which names its directory."""

Sentence = Annotated[str, Field(max_length=1000)]
"""Description shown on every run: a sentence or two."""


class ExperimentFile(Section):
    """What a scenario and a study of either kind have in common: the top level of a file that is computed."""

    name: Name = Field(description="short name, also the name of the directory")
    description: Sentence = Field(default="", description="one sentence")


Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Vector3 = tuple[float, float, float]

# Limits of the computation: beyond them squares overflow, inverses do not exist, or arrays fill the memory.

Duration = Annotated[float, Field(gt=0.0, le=1e9)]
"""Duration, s: at most thirty years, in which a double still resolves tenths of a microsecond."""

Moment = Annotated[float, Field(ge=0.0, le=1e9)]
"""Time since the beginning, s, with the limit of `Duration`."""


def in_order(span: tuple[float, float]) -> tuple[float, float]:
    """Return a time interval; raise ValueError if it does not end after it begins."""
    if not span[0] < span[1]:
        raise ValueError(f"the interval from {span[0]:g} s to {span[1]:g} s must end after it begins")
    return span


Span = Annotated[tuple[Moment, Moment], AfterValidator(in_order)]
"""Beginning and end of an interval of the run, s."""

TimeSpread = Annotated[float, Field(ge=0.0, le=1.0)]
"""1σ of an error of time, s."""

Factor = Annotated[float, Field(ge=1e-3, le=1e3)]
"""Factor of a standard deviation."""

Timeout = Annotated[float, Field(gt=0.0, le=1e6)]
"""Time after which a leg has failed, s: at most eleven days, more than the endurance of any aircraft."""

Height = Annotated[float, Field(ge=-12_000.0, le=1e6)]
"""Height above the ellipsoid, m: from the deepest sea to the limit of the series of the gravity models."""

_Speed = 12_000.0  # m/s, above the escape velocity, beyond which nothing stays near the Earth
Speed = Annotated[float, Field(ge=0.0, le=_Speed)]
"""Magnitude of a velocity, m/s, limited to about the escape velocity."""
Velocity = Annotated[float, Field(ge=-_Speed, le=_Speed)]
"""Component of a velocity, m/s, with the limit of `Speed`."""

Offset = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Error in its own unit: at most 1000 km, or a whole scale factor."""
Spread = Annotated[float, Field(ge=0.0, le=1e6)]
"""1σ of such an error."""
Noise = Annotated[float, Field(ge=1e-12, le=1e6)]
"""1σ of a reading's white noise; a smaller variance would be lost by rounding beside any variance of the filter."""
CorrelationTime = Annotated[float, Field(ge=1e-3, le=1e9)]
"""Correlation time, s: below the shortest sampling interval, the error is white noise; see `Duration` for the limit."""

Rate = Annotated[float, Field(ge=1e-6, le=1e6)]
"""Readings per second: from one in twelve days to more than any sensor gives."""
Frequency = Annotated[float, Field(ge=1e-6, le=1e5)]
"""Frequency, Hz: below, motion within a run is negligible; above, no structure vibrates."""
Turn = Annotated[float, Field(gt=0.0, le=36_000.0)]
"""Angle or amplitude of a rotation, degrees: at most a hundred turns."""
TurnRate = Annotated[float, Field(ge=-360_000.0, le=360_000.0)]
"""Angular rate, degrees per second: at most a thousand turns per second, more than a shell or a centrifuge has."""


def _points(axis: Vector3) -> Vector3:
    length = math.hypot(*axis)
    if not 1e-6 <= length <= 1e6:  # far beyond these limits, its square would overflow or vanish
        raise ValueError(
            f"axis = {list(axis)} has the length {length:g} and no usable direction; for example [0, 0, 1] is the down "
            "axis"
        )
    return axis


Axis = Annotated[Vector3, AfterValidator(_points)]
"""Direction in the block's axes, forward, right, down, of a length from 1e-6 to 1e6, usually 1."""

_Arm = Annotated[float, Field(ge=-1000.0, le=1000.0)]
LeverArm = tuple[_Arm, _Arm, _Arm]
"""Lever arm, forward, right, down, m, limited to the length of vehicles."""
