"""Public objects say what they take and give: every argument, result, error and attribute has its words."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

import sinssim
from sinssim.experiments.run.run_result import Run
from sinssim.recording.streams import Streams, StreamTable

FUNCTIONS = [name for name in sinssim.__all__ if inspect.isfunction(getattr(sinssim, name))]
CLASSES = [name for name in sinssim.__all__ if inspect.isclass(getattr(sinssim, name))]
KINDS: dict[str, type] = {name: getattr(sinssim, name) for name in CLASSES}
KINDS |= {"Run": Run, "Streams": Streams, "StreamTable": StreamTable}
_OWN = re.compile(r"\b(self|cls|_\w*)\b")


def parts(function: Any) -> dict[str, str]:
    """Return the parts of a docstring: "" for the sentences at its beginning, "Args", "Returns", "Raises"."""
    found = re.split(r"^(Args|Returns|Raises|Attributes|Yields):$", inspect.getdoc(function) or "", flags=re.MULTILINE)
    return {"": found[0], **dict(zip(found[1::2], found[2::2], strict=True))}


def lacking(function: Any) -> list[str]:
    """Return what the docstring of a function lacks."""
    doc, signature = parts(function), inspect.signature(function)
    lacks = [] if re.match(r"[A-Z\"`].*\.", doc[""].strip(), re.DOTALL) else ["a sentence"]
    arguments = [name for name in signature.parameters if not _OWN.fullmatch(name)]
    lacks += [f"the argument {name}" for name in arguments if not re.search(rf"\b{name}\b", doc.get("Args", doc[""]))]
    gives = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    first = doc[""].strip().lower()
    if gives and arguments and not ("Returns" in doc or "Yields" in doc or first.startswith(("return", "whether"))):
        lacks.append("what it returns")
    if re.search(r"^ +raise \w+Error\(", inspect.getsource(function), re.MULTILINE) and not (
        "Raises" in doc or "raise" in first
    ):
        lacks.append("what it raises")
    return lacks


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_say_what_they_take_and_give(name: str) -> None:
    doc = parts(getattr(sinssim, name))
    assert lacking(getattr(sinssim, name)) == []
    assert "Returns" in doc
    assert "Raises" in doc


@pytest.mark.parametrize("name", KINDS)
def test_classes_say_what_they_hold(name: str) -> None:
    """Every attribute of a dataclass, property and method."""
    kind = KINDS[name]
    lacks = [] if (kind.__doc__ or "").strip() and "(self" not in str(kind.__doc__) else ["a docstring"]
    attributes = parts(kind).get("Attributes", "") + parts(kind).get("Args", "")
    for field in getattr(kind, "__dataclass_fields__", {}):
        if not field.startswith("_") and not re.search(rf"\b{field}\b", attributes):
            lacks.append(f"the attribute {field}")
    for member, value in vars(kind).items():
        if member.startswith("_") or kind.__module__.startswith("sinssim.scenario"):
            continue
        function = getattr(value, "fget", None) or getattr(value, "func", None) or getattr(value, "__func__", value)
        if inspect.isfunction(function):
            inherited = next((vars(base)[member] for base in kind.__mro__[1:] if member in vars(base)), None)
            described = function.__doc__ or re.search(rf"\b{member}\b", attributes) or inherited is not None
            problems = lacking(function) if function.__doc__ else [] if described else ["a docstring"]
            lacks += [f"{member}: {problem}" for problem in problems]
    assert lacks == []


def test_arrays_have_shapes_and_units() -> None:
    """The attributes of the data that are exchanged name shape and unit."""
    from sinssim.data import ImuData, NavSolution, NavState

    for kind in (ImuData, NavState, NavSolution, sinssim.NavError):
        text = parts(kind)["Attributes"]
        for field, about in kind.__dataclass_fields__.items():
            if "Array" in str(about.type) and field not in ("flags", "q_nb", "defect"):
                entry = re.search(rf"\b{field}\b.*?(?=\n\S|\Z)", text, re.DOTALL)
                assert entry, (kind, field)
                assert re.search(r"\([^()]*\)", entry[0]), (kind, field)
                assert re.search(r"\b(s|m|rad|m/s)\b", entry[0]), (kind, field)
