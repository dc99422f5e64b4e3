"""The one exception of domecast."""

from __future__ import annotations

import json
from typing import Any


class DomecastError(ValueError):
    """A fault of a design, a scene, constants, a frame or an argument.

    `str(error)` is the whole message; the attributes hold its parts, as far as they are known: `file`, `line`, `column`,
    `field` (a path such as `leds.tilt_deg`), `value`, `problem`, `allowed`, `help` (what to do), `cure` (a value of a field
    that takes the fault away: `{"field": .., "value": ..}`), and `more` (further faults of the same run, as dictionaries).
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: int | None = None,
        column: int | None = None,
        field: str = "",
        value: str = "",
        problem: str = "",
        allowed: str = "",
        help: str | None = None,
        cure: dict[str, Any] | None = None,
        more: list[dict[str, Any]] | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.column = column
        self.field = field
        self.value = value
        self.problem = problem or message
        self.allowed = allowed
        self.help = help
        self.cure = cure
        self.more = more or []


def of(text: str) -> DomecastError:
    """The exception for the facts of a fault, as JSON."""
    facts = json.loads(text)
    return DomecastError(facts.pop("message"), **facts)
