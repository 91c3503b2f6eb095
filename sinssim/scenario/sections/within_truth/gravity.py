"""The [gravity] table of a scenario: the true gravity field, and the random remainder that no model has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sinssim.errors import InputError
from sinssim.section import Height, Section

if TYPE_CHECKING:
    from sinssim.earth.harmonics.coefficients import Coefficients
    from sinssim.scenario.sections.navigation import NavigationSection
    from sinssim.scenario.sections.truth import TruthSection

_ELLIPSOIDS = ("wgs84", "pz-90.11")
"""Ellipsoids whose centre is that of the models."""

_Deflection = Annotated[float, Field(ge=0.0, le=200.0)]
_Anomaly = Annotated[float, Field(ge=0.0, le=2000.0)]
_Kilometres = Annotated[float, Field(ge=0.1, le=5000.0)]
_Order = Annotated[int, Field(ge=2, le=3)]
_Degree = Annotated[int, Field(ge=2, le=2190)]


class RemainderSection(Section):
    """The part of gravity beyond the model, which is a Gauss-Markov process over the distance travelled. Values that
    are left out follow from the anomaly degree variances of Tscherning and Rapp (1974) beyond the model's degree, at
    `altitude_m`. Beyond degree 120, they are 4.8 arcsec, 32 mGal and 21 km on the ground."""

    order: _Order = Field(
        default=2, description="order of the process: 2, (1 + βd) exp(-βd), or 3, (1 + βd + β²d²/3) exp(-βd)"
    )
    xi_sigma_arcsec: _Deflection | None = Field(default=None, description="1σ of the deflection to the north")
    eta_sigma_arcsec: _Deflection | None = Field(default=None, description="1σ of the deflection to the east")
    anomaly_sigma_mgal: _Anomaly | None = Field(default=None, description="1σ of the gravity anomaly")
    correlation_km: _Kilometres | None = Field(default=None, description="distance at which the correlation is 1/e")
    altitude_m: Height = Field(default=0.0, description="height for the default values of this table")


class GravitySection(Section):
    """The true gravity field, which acts on the sensors. The navigation algorithm uses normal gravity unless
    navigation.gravity_degree is given."""

    model: Literal["normal", "egm2008", "icgem"] = Field(
        default="normal",
        description='"normal": gravity of the ellipsoid; "egm2008": the model of the package, to degree 120; "icgem": '
        "the model in `file`",
    )
    file: str | None = Field(
        default=None, description='coefficients in the format of the ICGEM (.gfc), relative to this file; for "icgem"'
    )
    degree: _Degree | None = Field(default=None, description="highest degree and order; default: that of the model")
    remainder: RemainderSection | None = None

    @model_validator(mode="before")
    @classmethod
    def _file_is_a_model(cls, data: Any) -> Any:
        """Fill in the model of a file."""
        if isinstance(data, dict) and data.get("file") is not None:
            return {"model": "icgem", **data}
        return data

    @model_validator(mode="after")
    def _model_can_be_had(self) -> Self:
        if (self.model == "icgem") != (self.file is not None):
            raise ValueError(
                'model = "icgem" needs file, the path of its coefficients (.gfc), and no other model takes one; here '
                f'model = "{self.model}" and ' + ("file is missing" if self.file is None else f'file = "{self.file}"')
            )
        if self.model == "normal" and self.degree is not None:
            raise ValueError(
                f'degree = {self.degree} would have no effect: model = "normal" has none; choose model = "egm2008"'
            )
        try:
            self.coefficients()
        except InputError as error:
            raise ValueError(str(error)) from error
        return self

    def coefficients(self, degree: int | None = None) -> Coefficients | None:
        """Return the coefficients of the model.

        Args:
            degree: highest degree; by default that of the section.

        Returns:
            The coefficients; None for normal gravity.

        Raises:
            InputError: the file cannot be used, or the model does not have the degree.
        """
        if self.model == "normal":
            return None
        degree = self.degree if degree is None else degree
        if self.model == "icgem":
            from sinssim.earth.harmonics.icgem import known_icgem

            assert self.file is not None
            return known_icgem(self.file, degree)
        from sinssim.earth.harmonics.coefficients import shipped

        model = shipped()
        return model if degree is None else model.to_degree(degree)


def check_gravity(
    gravity: GravitySection | None, navigation: NavigationSection, truth: TruthSection, sensors: str
) -> None:
    """Check [gravity] and the keys of other tables that depend on it.

    Args:
        gravity, navigation, truth: the tables of a scenario.
        sensors: its imu.sensor_set.type.

    Raises:
        ValueError: a key cannot be used with the others; the message names it.
    """
    degree = navigation.gravity_degree
    model = "normal" if gravity is None else gravity.model
    if degree is not None:
        if gravity is None or model == "normal":
            raise ValueError(
                f"navigation.gravity_degree = {degree} needs the model whose disturbance is to be compensated: add "
                '[gravity] with model = "egm2008", or remove the key'
            )
        if navigation.gravity != "normal":
            raise ValueError(
                f"navigation.gravity_degree = {degree} adds to normal gravity; navigation.gravity = "
                f'"{navigation.gravity}" is another model: remove one of the two'
            )
        if sensors in ("attitude-sensor", "platform"):
            raise ValueError(
                f'navigation.gravity_degree needs strapdown gyros, which imu.sensor_set.type = "{sensors}" lacks: '
                "remove one of the two"
            )
        has = gravity.coefficients()
        if has is not None and degree > has.degree:
            raise ValueError(
                f"navigation.gravity_degree = {degree} is above gravity.degree = {has.degree}: the navigation "
                "algorithm can use the model of the truth only to the same or a lower degree"
            )
    if model != "normal" and truth.gravity != "normal":
        raise ValueError(
            f'gravity.model = "{model}" adds to normal gravity; truth.gravity = "{truth.gravity}" is another '
            "model: remove truth.gravity"
        )
    if model != "normal" and truth.ellipsoid not in _ELLIPSOIDS:
        raise ValueError(
            f'gravity.model = "{model}" needs an ellipsoid about the centre of mass, {" or ".join(_ELLIPSOIDS)}; here '
            f'truth.ellipsoid = "{truth.ellipsoid}"'
        )


def check_gravity_of_log(gravity: GravitySection | None, navigation: NavigationSection) -> None:
    """Check [gravity] beside [log]: the readings felt the true field, and the table is what the navigator knows of it.

    Args:
        gravity, navigation: the tables of a scenario.

    Raises:
        ValueError: the table would change recorded readings, or have no effect.
    """
    if gravity is None:
        return
    if gravity.remainder is not None:
        raise ValueError(
            "[gravity.remainder] is a random part of the true field, but the data are recorded ([log]): remove it"
        )
    if navigation.gravity_degree is None:
        raise ValueError(
            "[gravity] would have no effect: recorded data ([log]) contain the true field, and the table describes "
            "only the model of the navigation algorithm. Add navigation.gravity_degree, for example 120, or remove "
            "[gravity]"
        )
