"""Defines the parts of a reproduced item: numbers beside the paper's, checks, claims, a picture."""

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
    "agrees": "our run agrees with the paper as printed",
    "differs": "our run agrees with the corrected equation; what the paper prints or claims is off",
    "fails": "our run is off, or could not be made",
}
#: Status -> whose error it is, in a few words.
WHOSE = {"agrees": "agrees", "differs": "paper is off", "fails": "our run is off"}


@dataclass(frozen=True)
class Row:
    """A number of the ``paper`` and ours, in the paper's unit. ``allowed`` is half its last digit, if not given."""

    paper: Published
    ours: float
    allowed: float | None = None
    note: str = ""

    @property
    def difference(self) -> float | None:
        """Return (ours - recomputed)/recomputed (the plain difference if that is zero); None if that is missing."""
        if not self.paper.recomputed:
            return None
        reference = float(self.paper.recomputed)
        return (self.ours - reference) / (reference or 1.0)

    @property
    def agrees(self) -> bool:
        """True if ours agrees with the recomputed number to the digits given there."""
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
    def printed_error(self) -> float | None:
        """Return (printed - recomputed)/recomputed (the plain difference if that is zero); None if one is missing."""
        if not (self.paper.printed and self.paper.recomputed):
            return None
        reference = float(self.paper.recomputed)
        return (float(self.paper.printed) - reference) / (reference or 1.0)

    @property
    def outcome(self) -> str:
        """Return whose error it is: one of `STATUSES`, or ``unchecked`` without a recomputed number."""
        if not self.paper.recomputed:
            return "unchecked"
        if not self.agrees:
            return "fails"
        return "differs" if self.contradicts else "agrees"

    @property
    def verdict(self) -> str:
        """Return the outcome as a sentence, with the size of the error."""
        if self.outcome == "fails":
            return f"our value is off by {_size(self.difference)}"
        if self.outcome == "differs":
            return f"agrees with the corrected equation; the printed value is off by {_size(self.printed_error)}"
        return {"agrees": "agrees with the printed value", "unchecked": "nothing to compare with"}[self.outcome]

    @property
    def reason(self) -> str:
        """Return why the printed number is off, and notes on ours."""
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
            "outcome": self.outcome,
            "printed_error": self.printed_error,
            "verdict": self.verdict,
            "reason": self.reason,
        }


def _size(error: float | None) -> str:
    """Return a relative error as text: in percent, as a factor if large, as a plain number if tiny."""
    if error is None or not math.isfinite(error):
        return "an unknown amount"
    if abs(error) < 1e-4:
        return f"{error:+.2g}"
    return f"a factor of {1 + error:.3g}" if error > 1 else f"{100 * error:+.2g} %"


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
    """The outcome of an item: its ``reproduction``, or the ``failure``; ``seconds`` taken."""

    item: Item
    reproduction: Reproduction | None
    failure: str = ""
    seconds: float = 0.0

    @property
    def made(self) -> Reproduction:
        """Return the reproduction; an empty one after a failure."""
        return self.reproduction or Reproduction()

    @property
    def status(self) -> str:
        """One of `STATUSES`."""
        if self.reproduction is None or not self.reproduction.agrees:
            return "fails"
        return "differs" if self.reproduction.contradicted else "agrees"

    @property
    def agreement(self) -> str:
        """Return as text whose error it is, and the worst number of each kind."""
        if self.reproduction is None:
            return f"not made: {self.failure}"
        made = self.made
        words = [self._whose_error()] if self.status != "agrees" else []
        compared = [row for row in made.rows if row.paper.recomputed]
        if compared:
            words.append(f"{sum(row.agrees for row in compared)} of {len(compared)} numbers to the digits given")
        if made.checks:
            worst = max(made.checks, key=lambda c: c.difference / c.limit)
            words.append(f"{worst.what}: {worst.difference:.1e} from {worst.reference}")
        return "; ".join(words)

    def _whose_error(self) -> str:
        """Return the sentence for an item with an error: worst printed number and claims, or our worst number."""
        wrong = [row for row in self.made.rows if row.outcome == self.status]
        error = "difference" if self.status == "fails" else "printed_error"
        wrong.sort(key=lambda row: abs(getattr(row, error) or 0.0), reverse=True)
        parts = []
        if wrong:
            name = wrong[0].paper.item.replace("_", " ")
            whose = "our" if self.status == "fails" else "the printed"
            parts.append(f"{whose} {name} is off by {_size(getattr(wrong[0], error))}")
            parts += [f"{len(wrong) - 1} more number{'s' * (len(wrong) > 2)} off"] if len(wrong) > 1 else []
        if self.status == "fails":
            return ", ".join(parts) or "our run is off"
        claims = [claim.holds for claim in self.made.claims]
        if denied := claims.count(False):
            parts.append(f"{denied} of {len(claims)} claims {'do' if denied > 1 else 'does'} not hold")
        return f"agrees with the corrected equation; {', '.join(parts)}"

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
    """Return rows of a published ``table`` for our values [SI] by item; a ``note`` is added to each reason."""
    papers = [published(table, item) for item in ours]
    return tuple(Row(paper, float(ours[paper.item]) / paper.si_factor, note=note) for paper in papers)


def largest_difference(values: ArrayLike, reference: ArrayLike) -> float:
    """Return the largest difference, relative to the largest value of the reference."""
    known = np.asarray(reference, dtype=float)
    return float(np.abs(np.asarray(values, dtype=float) - known).max() / np.abs(known).max())


def largest_ratio(values: ArrayLike, reference: ArrayLike) -> float:
    """Return the largest of the element-wise relative differences."""
    return float(np.abs(np.asarray(values, dtype=float) / np.asarray(reference, dtype=float) - 1).max())
