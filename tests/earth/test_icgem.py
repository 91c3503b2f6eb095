"""Files of coefficients: what is read, and what is refused by its reason."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sinssim.earth.harmonic_coefficients import known_icgem, read_icgem, shipped
from sinssim.errors import InputError

HEAD = """product_type gravity_field
modelname TEST
earth_gravity_constant {gm}
radius 0.63781363E+07
max_degree {degree}
norm {norm}
end_of_head =====
"""


def write(
    path: Path, degree: int = 8, norm: str = "fully_normalized", gm: str = "0.3986004415D+15", factor: float = 1
) -> Path:
    model = shipped()
    lines = [HEAD.format(gm=gm, degree=degree, norm=norm) + "gfc 0 0 1.0d0 0.0d0 0 0\n"]
    for n in range(2, degree + 1):
        for m in range(n + 1):
            c, s = (f"{factor * x[n, m]:.17e}".replace("e", "d") for x in (model.c, model.s))
            lines.append(f"gfc {n} {m} {c} {s} 0.1d-10 0.1d-10\n")
    path.write_text("".join(lines), encoding="utf-8")
    return path


def test_the_coefficients_are_those_written(tmp_path: Path) -> None:
    model = read_icgem(write(tmp_path / "a.gfc"))
    assert (model.name, model.degree, model.gm, model.radius) == ("TEST", 8, 3.986004415e14, 6378136.3)
    np.testing.assert_array_equal(model.c[2:], shipped().c[2:9, :9])
    np.testing.assert_array_equal(model.s, shipped().s[:9, :9])
    assert known_icgem(str(tmp_path / "a.gfc"), 4).degree == 4
    assert known_icgem(str(tmp_path / "a.gfc"), 4) is known_icgem(str(tmp_path / "a.gfc"), 4)


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        ({"norm": "unnormalized"}, "norm is 'unnormalized'; the coefficients must be fully_normalized"),
        ({"factor": 5.0**0.5}, r"C20 is -0\.00108263; fully normalised it is -0\.00048417 for .*another normalisation"),
        ({"gm": "4.9e12"}, r"earth_gravity_constant = 4\.9e\+12"),
        ({"gm": "much"}, "earth_gravity_constant = 'much' in the header is not a number"),
    ],
)
def test_another_normalisation_or_body(options: dict[str, str], wanted: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=wanted):
        read_icgem(write(tmp_path / "a.gfc", **options))  # type: ignore[arg-type]


def test_a_file_cut_short(tmp_path: Path) -> None:
    file = write(tmp_path / "a.gfc")
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(lines[:-5]), encoding="utf-8")
    with pytest.raises(InputError, match=r"degree 8 and order 4 is missing, with 4 others.*truncated"):
        read_icgem(file)
    assert read_icgem(file, 7).degree == 7
    file.write_text("".join(lines[:-5])[:-40], encoding="utf-8")
    with pytest.raises(InputError, match=r"a.gfc: line \d+: .* is it truncated\?"):
        read_icgem(file)
    file.write_text("".join(lines[:4]), encoding="utf-8")
    with pytest.raises(InputError, match='no line "end_of_head"'):
        read_icgem(file)


def test_a_degree_above_that_of_the_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="degree = 9, but the file holds max_degree = 8; give 2 to 8"):
        read_icgem(write(tmp_path / "a.gfc"), 9)


def test_a_model_that_varies_and_a_file_that_is_not_there(tmp_path: Path) -> None:
    file = write(tmp_path / "a.gfc")
    file.write_text(file.read_text(encoding="utf-8").replace("gfc 2 0", "gfct 2 0"), encoding="utf-8")
    with pytest.raises(InputError, match='"gfct" belongs to a model that varies with time'):
        read_icgem(file)
    with pytest.raises(InputError, match=r"none\.gfc: the coefficients of gravity cannot be read"):
        read_icgem(tmp_path / "none.gfc")


def test_lines_are_counted_from_the_first_of_the_file(tmp_path: Path) -> None:
    """Seven lines of header, then degree 0 in line 8, degree 2 from line 9 on."""
    file = write(tmp_path / "a.gfc", 3)
    lines = file.read_text(encoding="utf-8").splitlines()
    for row, change, words in (
        (10, "gfc 2 1 0.5", 'line 10: "gfc 2 1 0.5" is not "gfc degree order C S": is it truncated?'),
        (11, "gfc 2 3 0.5 0.5", "line 11: degree 2, order 3, C = 0.5, S = 0.5 are impossible"),
        (13, "trnd 3 1 0.5 0.5", 'line 13: "trnd" belongs to a model that varies with time; only "gfc" is used'),
    ):
        file.write_text("\n".join([*lines[: row - 1], change, *lines[row:]]), encoding="utf-8")
        with pytest.raises(InputError) as error:
            read_icgem(file)
        assert str(error.value) == f"{file}: {words}."
    file.write_text("\n".join([*lines[:11], *lines[12:13]]), encoding="utf-8")
    with pytest.raises(InputError) as error:
        read_icgem(file)
    assert str(error.value) == (
        f"{file}: the coefficient of degree 3 and order 0 is missing, with 2 others up to degree 3: the file is "
        "truncated."
    )


@pytest.mark.parametrize(("gm", "radius", "fine"), [
    ("3.95e14", "6.31e6", True), ("4.05e14", "6.49e6", True), ("3.89e14", "6.4e6", False), ("4.11e14", "6.4e6", False),
    ("4.0e14", "6.29e6", False), ("4.0e14", "6.51e6", False),
])  # fmt: skip
def test_constants_of_another_body(gm: str, radius: str, fine: bool, tmp_path: Path) -> None:
    file = write(tmp_path / "a.gfc", 2, gm=gm)
    file.write_text(file.read_text(encoding="utf-8").replace("0.63781363E+07", radius), encoding="utf-8")
    if fine:
        model = read_icgem(file)
        assert (model.gm, model.radius, model.name) == (float(gm), float(radius), "TEST")
        return
    constants = re.escape(f"= {float(gm):g} and radius = {float(radius):g}")
    with pytest.raises(
        InputError, match=rf"{constants} are not those of the Earth in m³/s² and m, 3\.986e14 and 6\.378e6"
    ):
        read_icgem(file)
