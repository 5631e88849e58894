"""What a window shows of a result: its own page as a part of the window's, and an error or a remark as a box."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from ..errors import IlgWarning
from ..provenance import Provenance
from ..report.page import fill
from ..result import Result

#: Argument -> what the window calls it, for messages.
SPELLING = {
    "model": "the field Electrical model",
    "drive": "the field Drive of a displacement alone (under More)",
    "displacement": "the command identify with --displacement",
    "onset": "the field Onset (under More)",
    "part": "the field Measurement number",
    "columns": "Columns and units",
    "units": "Columns and units",
    "displacement_delay": "the field Delay of the displacement (under More)",
    "electrode_resistance": "the field Electrode resistance (under More)",
}
#: Sections of a page that are open at first: the main picture, and the parameters.
_OPEN = ("Data, fit and residuals", "Picture", "Parameters", "Summary", "Requirements")


@dataclass(frozen=True)
class Answer:
    """A result of a long task: its page as ``html``, whether it is a ``success``, and what ``made`` is of use later."""

    html: str
    success: bool
    result: Result
    made: Any = None


def answer(result: Result, provenance: Provenance, success: bool, verdict: str, made: Any = None) -> Answer:
    """Return the answer of a result, whose ``verdict`` is one sentence on its ``success``."""
    result = result.with_provenance(provenance)
    content = {"page": result.page(), "open": _OPEN, "success": success, "verdict": verdict}
    return Answer(fill(Path(__file__).with_name("answer.html.j2"), content), success, result, made)


@contextmanager
def noting() -> Iterator[list[str]]:
    """Yield a list that gets, at the end of the block, the `IlgWarning`s that were issued in it."""
    lines: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", IlgWarning)
        try:
            yield lines
        finally:
            lines += dict.fromkeys(str(each.message) for each in caught if issubclass(each.category, IlgWarning))


def box(kind: str, *lines: str) -> str:
    """Return lines as boxes of a ``kind``: ``error``, ``warning``, ``good`` or ``note``."""
    role = ' role="alert"' if kind == "error" else ""
    return "".join(f'<p class="box {kind}"{role}>{escape(line)}</p>' for line in lines)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a small table."""
    cells = "".join(f"<th>{escape(title)}</th>" for title in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{cells}</tr>{body}</table></div>'
