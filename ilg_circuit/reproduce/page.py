"""The outcomes as one HTML page that needs nothing else: pictures are in it, and it opens offline."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..report.html import png, render
from .items import STATUSES, Outcome, Reproduction, Row
from .published import Published, misprints

_PAPERS = {
    "EC": "Electromechanical Coupling Model for Ionic Liquid Gel Soft Actuators",
    "CPG": "Motion Simulation of Ionic Liquid Gel Soft Actuators Based on CPG Control",
}
#: Sign and word of a status, for readers who see no colour.
_SIGNS = {"agrees": ("●", "agrees"), "differs": ("▲", "paper differs"), "fails": ("✖", "fails")}


def page(outcomes: Sequence[Outcome]) -> str:
    """Return the text of the page."""
    return render(
        Path(__file__).with_name("page.html.j2"),
        {
            "papers": [
                {
                    "short": short,
                    "name": name,
                    "items": [_item(o) for o in outcomes if o.item.id.startswith(f"{short}-")],
                }
                for short, name in _PAPERS.items()
            ],
            "statuses": [{"status": s, "sign": _SIGNS[s], "meaning": meaning} for s, meaning in STATUSES.items()],
            "counts": {s: sum(o.status == s for o in outcomes) for s in STATUSES},
            "contradictions": _contradictions(outcomes),
            "misprints": misprints(),
            "seconds": f"{sum(o.seconds for o in outcomes):.0f}",
        },
    )


def _item(outcome: Outcome) -> dict[str, Any]:
    item, made = outcome.item, outcome.reproduction or Reproduction()
    return {
        "id": item.id,
        "title": item.title,
        "caption": item.caption,
        "equation": item.equation,
        "commands": item.commands,
        "status": outcome.status,
        "sign": _SIGNS[outcome.status],
        "agreement": outcome.agreement,
        "failure": outcome.failure,
        "rows": [_row(row) for row in made.rows],
        "checks": [
            {
                "what": c.what,
                "reference": c.reference,
                "value": f"{c.value:.1e}",
                "limit": f"{c.limit:.1e}",
                "ok": c.agrees,
            }
            for c in made.checks
        ],
        "claims": made.claims,
        "unknown": made.unknown,
        "picture": png(made.figure) if made.figure is not None else "",
        "files": sorted(made.files),
    }


def _row(row: Row) -> dict[str, Any]:
    return {
        "quantity": _quantity(row.paper),
        "unit": row.paper.unit,
        "where": row.paper.where,
        "printed": row.paper.printed or "–",
        "recomputed": row.paper.recomputed or "–",
        "ours": f"{row.ours:.6e}" if "e" in row.paper.recomputed else f"{row.ours:#.7g}",
        "difference": "–" if row.difference is None else f"{row.difference:+.1e}",
        "ok": row.agrees,
        "contradicts": row.contradicts,
        "reason": row.reason,
    }


def _quantity(paper: Published) -> str:
    name = paper.item.replace("_", " ")
    return f"{name} {paper.symbol}" if paper.symbol and len(paper.symbol) < 10 else name


def _contradictions(outcomes: Sequence[Outcome]) -> list[dict[str, str]]:
    """Return every printed number that differs from the recomputed one, once."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for outcome in outcomes:
        for row in (outcome.reproduction or Reproduction()).rows:
            if row.contradicts:
                entry = _row(row) | {"id": outcome.item.id, "reason": row.paper.reason}
                found.setdefault((row.paper.table, row.paper.item), entry)
    return list(found.values())
