"""A finding about recorded data: a fact, a doubt, or an error, in one sentence, with what to do about it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from sinssim.errors import printable

Grade = Literal["fact", "doubt", "wrong"]


@dataclass(frozen=True)
class Finding:
    """One sentence about recorded data.

    Attributes:
        subject: what it is about, for example "time", "accelerometers", "clock".
        grade: "fact"; "doubt", which a person should look into; "wrong", with which results are worthless.
        text: the sentence, with the number.
        fix: what to do about it; empty for facts.
        numbers: the numbers of the sentence by name, with units in the names.
    """

    subject: str
    grade: Grade
    text: str
    fix: str = ""
    numbers: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", printable(self.text))

    @property
    def sentence(self) -> str:
        """The sentence and the fix."""
        return f"{self.text} {self.fix}".rstrip()


def fact(subject: str, text: str, **numbers: Any) -> Finding:
    """Return a fact."""
    return Finding(subject, "fact", text, "", numbers)


def doubt(subject: str, text: str, fix: str, **numbers: Any) -> Finding:
    """Return a doubt."""
    return Finding(subject, "doubt", text, fix, numbers)


def wrong(subject: str, text: str, fix: str, **numbers: Any) -> Finding:
    """Return an error of the data."""
    return Finding(subject, "wrong", text, fix, numbers)
