"""Files of coefficients: what is read, and what is refused by its reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sinssim.earth.harmonics.coefficients import shipped
from sinssim.earth.harmonics.icgem import known_icgem, read_icgem
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
        ({"factor": 5.0**0.5}, r"C20 is -0\.00108263.*another normalisation"),
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
