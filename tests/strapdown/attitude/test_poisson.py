"""The nearest rotation, whichever single element of the matrix has to change."""

from __future__ import annotations

import numpy as np
import pytest

from sinssim.strapdown.attitude import REGISTRY, poisson
from sinssim.strapdown.attitude.poisson import nearest_rotation_k


@pytest.mark.parametrize("row", range(3))
@pytest.mark.parametrize("column", range(3))
def test_a_matrix_stretched_along_one_axis(row: int, column: int) -> None:
    """A rotation of the axes into each other, stretched along one: Newton's steps change one element alone."""
    rotation = np.roll(np.eye(3), row - column, axis=0)
    stretched = rotation.copy()
    stretched[row, column] *= 1.3
    found = np.reshape(nearest_rotation_k(*stretched.ravel()), (3, 3))
    np.testing.assert_allclose(found, rotation, rtol=0, atol=2e-15)


def test_the_orders_step_in_the_plain_increment() -> None:
    """As the chapter has them: without the coning correction, which the algorithm "poisson" has; -ortho corrects B."""
    for order in (1, 2, 3, 4):
        for name, orthonormal in ((f"poisson-{order}", False), (f"poisson-{order}-ortho", True)):
            assert REGISTRY[name].variant == {"ORDER": order, "COMPENSATED": False, "ORTHONORMAL": orthonormal}
    assert (REGISTRY["poisson"].variant, poisson.COMPENSATED, poisson.ORDER) == ({}, True, 4)
