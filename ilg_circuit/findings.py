"""Findings: what a result or a file should be known for, as data; one sentence a code, made where it is shown.

Decisions ask for codes and numbers, never for words.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from string import Formatter
from typing import Any

from .units import format_quantity


@dataclass(frozen=True)
class Finding:
    """One finding: its ``code`` (a key of `SENTENCES`), its ``subject`` (a file, a quantity; may be empty), numbers.

    ``values`` fill the sentence's fields. ``str(finding)`` is the sentence, after its subject.
    """

    code: str
    subject: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        sentence = _FORMATTER.vformat(SENTENCES[self.code], (), self.values)
        return f"{self.subject}: {sentence}" if self.subject else sentence

    def about(self, subject: str) -> Finding:
        """The same of ``subject``, before what it is about already."""
        return Finding(self.code, f"{subject}: {self.subject}" if self.subject else subject, self.values)

    def to_dict(self) -> dict[str, Any]:
        """Code, subject, numbers and sentence, ready for JSON."""
        return {"code": self.code, "subject": self.subject, "values": dict(self.values), "text": str(self)}


def sentences(findings: Iterable[Finding]) -> tuple[str, ...]:
    """The sentences of ``findings``, each once."""
    return tuple(dict.fromkeys(map(str, findings)))


def codes(findings: Iterable[Finding]) -> set[str]:
    """The codes of ``findings``."""
    return {finding.code for finding in findings}


class _Formatter(Formatter):
    """Formats as `str.format`; ``{x:@V3}`` is a quantity in volt with three digits, ``{n:#point}`` a count of points.

    Lists are written with commas.
    """

    def format_field(self, value: Any, format_spec: str) -> Any:
        if format_spec.startswith("@"):
            return format_quantity(float(value), format_spec[1:-1], int(format_spec[-1]))
        if format_spec.startswith("#"):
            return f"{value} {format_spec[1:]}{'s' * (value != 1)}"
        if not format_spec and isinstance(value, list | tuple):
            return ", ".join(map(str, value))
        return super().format_field(value, format_spec)


_FORMATTER = _Formatter()

#: code -> sentence; fields are names in ``values``.
SENTENCES: dict[str, str] = {
    # -- intervals --
    "profile-failed": "no profile of {parameter} ({reason}); its interval is from a block bootstrap",
    "profile-open": "the data set {parameter} no {sides} limit within a factor of {reach:.0e}",
    "chain-short": "the Markov chain is short ({chain}); its intervals are rough",
    # -- measurements --
    "voltage-column": "voltage is the column {column}",
    "columns-ignored": "columns not understood and left out: {columns}",
    "overloaded": "{count:#reading} marked by the instrument as overloaded: current left out",
    "readings-at-one-time": "{count:#reading} at the same time as the next one: left out",
    "voltage-noise-averaged": "noise on the voltage ({noise:@V2} rms about its levels) was averaged out",
    "current-clipped": "current is clipped at {level:@A4}: {count:#sample} at the instrument's limit left out",
    "current-rises": "the current drifts: it rises again by {rise:@A3} from {since:@s3} on, which no model here does",
    "current-not-settled": (
        "the current has not settled: over the last third it falls by {fall:@A3}, no slower than before"
    ),
    "rows-blank": "{count} of {total} rows have no {quantity} (drop-outs): left out",
    "readings-apart": (
        "{count:#reading} of {reading:@{unit}5} far from all others of the {quantity} (drop-outs): left out"
    ),
    "rest-drifts": "the {quantity} drifts by {drift:@{unit}3} while at rest, before the onset",
    "displacement-too-short": "fewer than {needed} displacement samples after the onset: no displacement fit",
    "points-blank": "{count:#point} without a number: left out",
    "points-without-frequency": ("{count:#point} whose frequency is not positive (or beyond all measure): left out"),
    "points-dropped-out": "{count:#point} with no sensible reading (a drop-out): left out",
    "points-repeated": "{count:#point} at a frequency that was there before (the first reading is kept): left out",
    "points-inductive": (
        "{count:#point} from {least:@Hz4} on, where Im Z is positive (the leads' inductance): left out"
    ),
    "points-active": "{count:#point} with Re Z below zero, which no passive strip has",
}
