"""Makes one self-contained HTML page of all outcomes; it opens offline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..report.page import fill, png
from .items import STATUSES, WHOSE, Outcome, Row
from .published import Published, misprints

_PAPERS = {
    "EC": "Electromechanical Coupling Model for Ionic Liquid Gel Soft Actuators",
    "CPG": "Motion Simulation of Ionic Liquid Gel Soft Actuators Based on CPG Control",
}
#: Sign and words of a status, for readers who see no colour.
_SIGNS = {status: f"{sign} {WHOSE[status]}" for status, sign in zip(STATUSES, "●▲✖", strict=True)}


def page(outcomes: Sequence[Outcome]) -> str:
    """Return the text of the page; the template formats the numbers."""
    contradictions: dict[Published, tuple[Outcome, Row]] = {}  # every printed number once
    for outcome in outcomes:
        for row in outcome.made.rows:
            if row.contradicts:
                contradictions.setdefault(row.paper, (outcome, row))
    papers = [
        {"short": short, "name": name, "outcomes": [o for o in outcomes if o.item.id.startswith(f"{short}-")]}
        for short, name in _PAPERS.items()
    ]
    content = {
        "papers": papers,
        "statuses": STATUSES,
        "signs": _SIGNS,
        "shown": [outcome.status for outcome in outcomes],
        "contradictions": contradictions.values(),
        "misprints": misprints(),
        "seconds": f"{sum(o.seconds for o in outcomes):.0f}",
        "png": png,
    }
    return fill(Path(__file__).with_name("page.html.j2"), content)
