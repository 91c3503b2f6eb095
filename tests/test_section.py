"""What the base of all tables states of keys that exclude or need each other."""

from __future__ import annotations

from typing import Annotated, Any

import pytest

from sinssim.errors import InputError
from sinssim.toml_section import Keys, Section, once


class _Table(Section):
    exactly_one = (Keys(("a", "b"), "a table has a or b"),)
    at_most_one = (Keys(("c", "d", "names"), "the order"),)
    paired = (("e", "f"),)
    rules = (
        (lambda s: s.c is not None and s.c > 9, "c = {s.c} is too large"),
        (lambda s: s.d is not None and s.changed("e", "f"), "{it} has no effect beside d = {s.d}"),
    )

    a: int | None = None
    b: int | None = None
    c: int | None = None
    d: int | None = None
    e: int | None = None
    f: int | None = None
    names: Annotated[tuple[str, ...], once("name")] = ()

    @classmethod
    def normalized(cls, data: dict[str, Any]) -> dict[str, Any]:
        return {"a": data["half_a"] * 2} if "half_a" in data else data


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({}, "_Table: a table has a or b: give exactly one of them; here none is given."),
        ({"a": 1, "b": 0}, "_Table: a table has a or b: give exactly one of them; here a and b are given."),
        ({"a": 0, "c": 1, "names": ["x"]}, "_Table: c and names both give the order: remove one of them."),
        ({"a": 0, "f": 1}, "_Table: e and f belong together: give both or neither; here f is given."),
        ({"a": 0, "c": 10}, "_Table: c = 10 is too large."),
        ({"a": 0, "d": 1, "e": 2, "f": 3}, "_Table: e has no effect beside d = 1."),
        ({"a": 0, "names": ["x", "y", "x"]}, "_Table: names: 'x' stands 2 times; give each name once."),
    ],
)
def test_keys_that_do_not_fit_together(keys: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as told:
        _Table(**keys)  # type: ignore[arg-type]
    assert str(told.value) == message


@pytest.mark.parametrize("keys", [{"a": 0}, {"b": 1, "c": 0}, {"a": 1, "e": 0, "f": 0, "names": ["x", "y"]}])
def test_keys_that_fit_together(keys: dict[str, object]) -> None:
    assert _Table(**keys).a == keys.get("a")  # type: ignore[arg-type]


def test_what_stands_for_keys_is_replaced_by_them() -> None:
    assert _Table(half_a=3).a == 6  # type: ignore[call-arg]
