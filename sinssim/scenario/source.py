"""What a scenario navigates: exactly one of several tables, each of which is a class."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_args

from pydantic import BeforeValidator, Discriminator, Tag
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from sinssim.logs.log import Log
from sinssim.logs.track.track import Track
from sinssim.truth.flight.flight import Flight
from sinssim.truth.motions.closed_forms import AnyClosedForm
from sinssim.truth.motions.great_circle import GreatCircleFlight
from sinssim.truth.motions.parked import ParkedVehicle
from sinssim.truth.turntable.turntable import Turntable
from sinssim.truth.vehicles.drive import Drive
from sinssim.truth.vehicles.voyage import Voyage
from sinssim.truth.vertical_plane import OneComponent


class Given(NamedTuple):
    """A table as it is given, which its contents do not name."""

    table: str
    contents: Any


def _the_only_one(given: tuple[Given, ...]) -> Given:
    if len(given) == 1:
        return given[0]
    names = [f"[{name}]" for name in TABLES]
    raise PydanticCustomError(
        "value_error" if given else "no_table",
        "{error}",
        {
            "tables": [(name,) for name in TABLES],
            "given": [(one.table,) for one in given],
            "error": f"exactly one of {', '.join(names[:-1])} and {names[-1]} must give the motion; here "
            + (f"there are {' and '.join(f'[{one.table}]' for one in given)}" if given else "all of them are missing"),
        },
    )


_Contents = BeforeValidator(lambda given: given.contents if isinstance(given, Given) else given)

AnySource = Annotated[
    Annotated[Flight, _Contents, Tag("flight")]
    | Annotated[ParkedVehicle, _Contents, Tag("parked")]
    | Annotated[GreatCircleFlight, _Contents, Tag("great_circle")]
    | Annotated[AnyClosedForm, _Contents, Tag("motion")]
    | Annotated[Track, _Contents, Tag("track")]
    | Annotated[Drive, _Contents, Tag("drive")]
    | Annotated[Voyage, _Contents, Tag("voyage")]
    | Annotated[Turntable, _Contents, Tag("turntable")]
    | Annotated[Log, _Contents, Tag("log")]
    | Annotated[OneComponent, _Contents, Tag("one_component")],
    Discriminator(lambda one: getattr(one, "table", None)),
    BeforeValidator(_the_only_one),
]
"""One of these tables."""

TABLES = {
    option.__metadata__[-1].tag: FieldInfo.from_annotation(option.__origin__ | None)
    for option in get_args(get_args(AnySource)[0])
}
"""The keys of these tables in a file."""

TRAVELLING = [
    one.__metadata__[-1].tag
    for one in get_args(get_args(AnySource)[0])
    if (get_args(one.__origin__) or (one.__origin__,))[0].travels
]
"""Those of vehicles that leave their place."""
