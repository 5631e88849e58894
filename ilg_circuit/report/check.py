"""Presents a check: the differences between independent solutions."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import argument
from ..simulation.check import Difference
from .tables import aligned


def summary(differences: Sequence[Difference]) -> str:
    """Return the table that ``--check`` prints."""
    rows = [("quantity", "compared with", "largest difference / maximum")]
    rows += [(d.quantity, d.reference, f"{d.value:.1e}") for d in differences]
    lines = aligned(rows, "<<>")
    references = {d.reference for d in differences if d.quantity == "displacement"}
    if references and "closed form" not in references:
        lines.append(
            f"(no closed form of the displacement for this case: it exists for {argument('beam', 'static')}, Re = 0)"
        )
    return "\n".join(lines)
