"""The kinds of the table [motion], selected by its key `type`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sinssim.truth.motions.coning import ConingMotion, SpinConeMotion
from sinssim.truth.motions.rocking import ScullingMotion, SpinRockMotion
from sinssim.truth.motions.rotation_table import RotationTableMotion

AnyClosedForm = Annotated[
    ConingMotion | ScullingMotion | SpinConeMotion | SpinRockMotion | RotationTableMotion,
    Field(discriminator="type"),
]
