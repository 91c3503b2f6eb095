"""The [aiding] section of a scenario, composed from the registry of aiding sensors."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from pydantic import ModelWrapValidatorHandler, create_model, model_validator

from sinssim.section import Section
from sinssim.sensors.aiding.base.sensor import AidingSensor
from sinssim.sensors.aiding.gnss import Gnss
from sinssim.sensors.aiding.registry import BROKEN, CLASSES, sensor_class
from sinssim.system.own_content.layout import Item
from sinssim.system.own_content.registry import ensure, registered

_Sensor = TypeVar("_Sensor", bound=AidingSensor)


def _own_item(name: str) -> Item | None:
    """Return the aiding sensor outside the package whose table has a name, if there is one."""
    ensure("aiding", name)
    return registered("aiding", name)


@cache
def _with_own(base: type[_Tables], own: tuple[tuple[str, type[AidingSensor]], ...]) -> type[_Tables]:
    """Return the tables of [aiding] with those of further sensors."""
    fields: Any = {name: (one | None, None) for name, one in own}
    made: type[_Tables] = create_model("AidingSection", __base__=base, __module__=__name__, **fields)
    return made


class _Tables(Section):
    """The aiding sensors of the filter. Each table switches on one sensor."""

    @model_validator(mode="wrap")
    @classmethod
    def _own_sensors_too(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        own = {
            name: sensor_class(item)
            for name in (data if isinstance(data, dict) else ())
            if name not in cls.model_fields and (item := _own_item(name)) is not None
        }
        return cast(Self, _with_own(cls, tuple(own.items())).model_validate(data)) if own else handler(data)

    @model_validator(mode="before")
    @classmethod
    def _can_be_used(cls, data: Any) -> Any:
        for name in data if isinstance(data, dict) else ():
            if name in BROKEN:
                raise ValueError(f"[aiding.{name}]: {BROKEN[name]}")
        return data

    @model_validator(mode="after")
    def _something(self) -> Self:
        if not self.sensors():
            raise ValueError(f"it has no sensor; give one or more of the tables {', '.join(type(self).model_fields)}")
        return self

    @classmethod
    def own_table(cls, name: str) -> type[AidingSensor] | None:
        """Return the class of a table outside the package, for the words of a mistake in it."""
        item = registered("aiding", name)
        return None if item is None or name in cls.model_fields else sensor_class(item)

    def sensors(self) -> dict[str, AidingSensor]:
        """Return the sensors that are switched on, by table."""
        return {name: sensor for name, sensor in self if sensor is not None}

    def sensor(self, kind: type[_Sensor]) -> _Sensor | None:
        """Return the sensor of a class, None if it is not switched on."""
        return next((sensor for sensor in self.sensors().values() if isinstance(sensor, kind)), None)

    @property
    def outages(self) -> tuple[tuple[float, float], ...]:
        """The spans without satellites, s, in order."""
        gnss = self.sensor(Gnss)
        return () if gnss is None else tuple(sorted(gnss.outages_s))


if TYPE_CHECKING:
    AidingSection = _Tables
else:
    AidingSection = create_model(
        "AidingSection",
        __base__=_Tables,
        __module__=__name__,
        __doc__=_Tables.__doc__,
        **{name: (sensor | None, None) for name, sensor in CLASSES.items()},
    )


def describe_sensors() -> dict[str, str]:
    """Return the tables of [aiding] with a description of each.

    Returns:
        The first line of each sensor's docstring by table; for an unusable sensor, the reason.
    """
    sentences = {name: (sensor.__doc__ or "").split("\n")[0] for name, sensor in CLASSES.items()}
    return sentences | {name: f"(cannot be used: {why})" for name, why in BROKEN.items()}
