"""The laws of bending that an identification compared, as text and as a section of a page."""

from __future__ import annotations

from collections.abc import Sequence

from ..identification.coupling_contest import LawRow
from ..identification.identification import Identification
from .page import Grid, Section

_HEADER = ("law of bending", "parameters", "rms", "BIC above the best", "prediction", "verdict")


def law_lines(result: Identification) -> list[str]:
    """Return the laws as lines for a terminal, an empty one before; none where none were compared."""
    laws = result.coupling.laws if result.coupling is not None else ()
    if len(laws) < 2:
        return []
    rows = [("law", "parameters", "rms", "BIC - best", "prediction", "verdict"), *_rows(laws)]
    return ["", *(f"{a:<14}{b:>11}{c:>9}{d:>12}{e:>12}   {f}".rstrip() for a, b, c, d, e, f in rows)]


def law_sections(result: Identification) -> list[Section]:
    """Return a section with the laws; none where none were compared."""
    laws = result.coupling.laws if result.coupling is not None else ()
    if len(laws) < 2:
        return []
    chosen = frozenset(k for k, each in enumerate(laws) if each.chosen)
    return [Section("Laws of bending", [Grid(_HEADER, _rows(laws), words=frozenset({0, 5}), marked=chosen)])]


def _rows(laws: Sequence[LawRow]) -> list[tuple[str, str, str, str, str, str]]:
    """Return the cells; the prediction is of a file from all others, with a gain of its own."""

    def row(each: LawRow) -> tuple[str, str, str, str, str, str]:
        predicted = "" if each.prediction is None else f"{each.prediction:.2%}"
        verdict = each.against or ("chosen" if each.chosen else "as good as the chosen one" if each.alike else "")
        return each.law, f"{each.parameters}", f"{each.relative_rms:.2%}", f"{each.bic:.1f}", predicted, verdict

    return [row(each) for each in laws]
