"""Parts of a reproduced table or figure: numbers beside the paper's, checks, the paper's claims, a picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..report.axes import Figure
from .paper_runs import PaperRuns
from .published import Published, half_a_digit, published

#: Statuses of an item and their meaning, best first.
STATUSES = {
    "agrees": "our run agrees, and nothing here contradicts the paper",
    "differs": "our run agrees with what the paper's equations recompute to; what it prints or claims differs",
    "fails": "our run disagrees, or could not be made",
}


@dataclass(frozen=True)
class Row:
    """A number of the ``paper`` and ours, in the paper's unit. ``allowed`` is half its last digit, if not given."""

    paper: Published
    ours: float
    allowed: float | None = None
    note: str = ""

    @property
    def difference(self) -> float | None:
        """Ours less the recomputed number, relative to that (absolute where it is zero); None where there is none."""
        if not self.paper.recomputed:
            return None
        reference = float(self.paper.recomputed)
        return (self.ours - reference) / (reference or 1.0)

    @property
    def agrees(self) -> bool:
        """True if ours is the recomputed number to the digits given there."""
        if not self.paper.recomputed:
            return True
        allowed = self.paper.rounding if self.allowed is None else self.allowed
        return abs(self.ours - float(self.paper.recomputed)) <= allowed * 1.000001

    @property
    def contradicts(self) -> bool:
        """True if the printed number differs from the recomputed one beyond rounding."""
        printed, recomputed = self.paper.printed, self.paper.recomputed
        if not (printed and recomputed):
            return False
        rounding = max(half_a_digit(printed), self.paper.rounding)
        return abs(float(printed) - float(recomputed)) > rounding * 1.000001

    @property
    def reason(self) -> str:
        return "; ".join(text for text in (self.paper.reason, self.note) if text)

    def to_dict(self) -> dict[str, Any]:
        return {
            "quantity": self.paper.item,
            "where": self.paper.where,
            "unit": self.paper.unit,
            "printed": float(self.paper.printed) if self.paper.printed else None,
            "recomputed": float(self.paper.recomputed) if self.paper.recomputed else None,
            "ours": self.ours if math.isfinite(self.ours) else None,
            "difference": self.difference,
            "agrees": self.agrees,
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Check:
    """Comparison of ``what`` with ``reference``: the largest ``difference`` relative to the largest value."""

    what: str
    reference: str
    difference: float
    limit: float

    @property
    def agrees(self) -> bool:
        return self.difference <= self.limit

    def to_dict(self) -> dict[str, Any]:
        return asdict(self) | {"agrees": self.agrees}


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, whether it ``holds`` in our run (None: cannot be known), and what was found."""

    text: str
    holds: bool | None
    found: str

    @property
    def verdict(self) -> str:
        return {True: "holds", False: "does not hold", None: "cannot be known"}[self.holds]

    def to_dict(self) -> dict[str, Any]:
        return {"claim": self.text, "verdict": self.verdict, "found": self.found}


@dataclass(frozen=True)
class Reproduction:
    """A reproduced item. ``unknown``: what the paper does not say, and the assumption made; ``files``: name -> text.

    ``holds``: for each of the item's claims in ``items.toml`` whether it holds; ``numbers`` fill what was found.
    """

    rows: tuple[Row, ...] = ()
    checks: tuple[Check, ...] = ()
    claims: tuple[Claim, ...] = ()
    unknown: tuple[str, ...] = ()
    figure: Figure | None = None
    files: Mapping[str, str] = field(default_factory=dict)
    holds: tuple[bool | None, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)

    @property
    def agrees(self) -> bool:
        return all(row.agrees for row in self.rows) and all(check.agrees for check in self.checks)

    @property
    def contradicted(self) -> bool:
        return any(row.contradicts for row in self.rows) or any(claim.holds is False for claim in self.claims)


@dataclass(frozen=True)
class Item:
    """One table, figure or equation of a paper and how it is remade.

    ``equation`` is HTML, written in this package. ``commands`` are what a user can run to get the same.
    """

    id: str
    title: str
    caption: str
    equation: str
    commands: tuple[str, ...]
    make: Callable[[PaperRuns], Reproduction]
    needs_arm: bool = False


@dataclass(frozen=True)
class Outcome:
    """An item after the attempt: its ``reproduction``, or the ``failure``; ``seconds`` that it took."""

    item: Item
    reproduction: Reproduction | None
    failure: str = ""
    seconds: float = 0.0

    @property
    def made(self) -> Reproduction:
        """The reproduction, an empty one after a failure."""
        return self.reproduction or Reproduction()

    @property
    def status(self) -> str:
        """One of `STATUSES`."""
        if self.reproduction is None or not self.reproduction.agrees:
            return "fails"
        return "differs" if self.reproduction.contradicted else "agrees"

    @property
    def agreement(self) -> str:
        """The worst number of each kind, as text."""
        if self.reproduction is None:
            return f"not made: {self.failure}"
        words, made = [], self.made
        compared = [row for row in made.rows if row.paper.recomputed]
        if compared:
            words.append(f"{sum(row.agrees for row in compared)} of {len(compared)} numbers to the digits given")
        if made.checks:
            worst = max(made.checks, key=lambda c: c.difference / c.limit)
            words.append(f"{worst.what}: {worst.difference:.1e} from {worst.reference}")
        denied = sum(claim.holds is False for claim in made.claims)
        if denied:
            words.append(f"{denied} of {len(made.claims)} claims not borne out")
        return "; ".join(words)

    def to_dict(self) -> dict[str, Any]:
        made = self.made
        return {
            "id": self.item.id,
            "title": self.item.title,
            "light": self.status,
            "agreement": self.agreement,
            "failure": self.failure,
            "seconds": round(self.seconds, 3),
            "commands": list(self.item.commands),
            "rows": [row.to_dict() for row in made.rows],
            "checks": [check.to_dict() for check in made.checks],
            "claims": [claim.to_dict() for claim in made.claims],
            "unknown": list(made.unknown),
        }


def rows(table: str, ours: Mapping[str, float], note: str = "") -> tuple[Row, ...]:
    """Rows of a published ``table`` from our values [SI] by item; a ``note`` is added to their reasons."""
    papers = [published(table, item) for item in ours]
    return tuple(Row(paper, float(ours[paper.item]) / paper.si_factor, note=note) for paper in papers)


def largest_difference(values: ArrayLike, reference: ArrayLike) -> float:
    """Largest difference over the reference's largest value."""
    known = np.asarray(reference, dtype=float)
    return float(np.abs(np.asarray(values, dtype=float) - known).max() / np.abs(known).max())


def largest_ratio(values: ArrayLike, reference: ArrayLike) -> float:
    """Largest relative difference, each number relative to its own size."""
    return float(np.abs(np.asarray(values, dtype=float) / np.asarray(reference, dtype=float) - 1).max())
