"""Findings: what a result or a file should be known for, as data; one sentence a code, made where it is shown.

Decisions ask for codes and numbers, never for words. The sentences stand in findings.toml.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from string import Formatter
from typing import Any

from .errors import Argument, argument
from .units import format_quantity


@dataclass(frozen=True)
class Finding:
    """A finding on data or a result: a remark with a code, which decisions use, and a sentence, which people read.

    ``str(finding)`` is the sentence, after its subject.

    Attributes
    ----------
    code : str
        A key of `SENTENCES`.
    subject : str
        A file or a quantity; may be empty.
    values : mapping of str to Any
        Numbers and names that fill the sentence's fields.
    """

    code: str
    subject: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        sentence = _FORMATTER.vformat(SENTENCES[self.code], (), self.values)
        return f"{self.subject}: {sentence}" if self.subject else sentence

    def about(self, subject: str) -> Finding:
        """Return the finding with ``subject`` before its own subject."""
        return Finding(self.code, f"{subject}: {self.subject}" if self.subject else subject, self.values)

    def to_dict(self) -> dict[str, Any]:
        """Return the code, subject, numbers and sentence, ready for JSON."""
        return {"code": self.code, "subject": self.subject, "values": dict(self.values), "text": str(self)}


def sentences(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Return the sentences of ``findings``, each once."""
    return tuple(dict.fromkeys(map(str, findings)))


class Warned:
    """Mixin of results that have ``findings``: their sentences as warnings."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as sentences."""
        found: Iterable[Finding] = getattr(self, "findings", ())
        return sentences(found)


def codes(findings: Iterable[Finding]) -> set[str]:
    """Return the codes of ``findings``."""
    return {finding.code for finding in findings}


#: Codes that are listed first: the result is wrong, or only a part of it holds.
_FIRST = (
    "not-a-success",
    "misfit",
    "file-not-described",
    "displacement-not-fitted",
    "files-inconsistent",
    "file-outlying",
    "current-out-of-proportion",
    "voltage-out-of-proportion",
    "displacement-out-of-proportion",
    "port-out-of-proportion",
    "contact-lost",
    "voltage-lost",
    "voltage-lost-held",
    "current-rises",
    "kramers-kronig-residuals",
    "spectrum-misfit",
    "richer-model-untried",
    "no-model-determined",
    "not-determined",
    "electron-path-open",
    "electron-path-vague",
    "start-not-confirmed",
    "displacement-not-described",
    "displacement-opposed",
    "displacements-inconsistent",
    "displacements-apart",
    "displacement-shortened",
    "displacement-clipped",
    "one-pole-not-enough",
    "residuals-structured",
)
#: Codes that are listed last: routine remarks.
_LAST = (
    "residuals-autocorrelated",
    "displacement-autocorrelated",
    "columns-ignored",
    "lines-below",
    "voltage-column",
    "displacement-thinned",
    "fitted-until",
)


def by_importance(findings: Iterable[Finding]) -> list[Finding]:
    """Return ``findings`` with the most important first, otherwise in their order."""
    place = {code: k for k, code in enumerate(_FIRST)} | dict.fromkeys(_LAST, len(_FIRST) + 1)
    return sorted(findings, key=lambda finding: place.get(finding.code, len(_FIRST)))


class _Formatter(Formatter):
    """Formats as `str.format`; ``{x:@V3}`` is a quantity in volt with three digits, ``{x:@{unit}3}`` one whose unit
    is a value, ``{n:#point}`` a count of points.

    ``{--model}`` and ``{--model:rc2}`` are an argument as users write it, ``{name:--}`` one that a value names. Lists
    are written with commas.
    """

    def get_value(self, key: int | str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        if isinstance(key, str) and key.startswith("--"):
            return argument(key[2:])
        return super().get_value(key, args, kwargs)

    def format_field(self, value: Any, format_spec: str) -> Any:
        if isinstance(value, Argument):
            return argument(value.name, format_spec or None)
        if format_spec == "--":
            return argument(str(value))
        if format_spec.startswith("@"):
            return format_quantity(float(value), format_spec[1:-1], int(format_spec[-1]))
        if format_spec.startswith("#"):
            return f"{value} {format_spec[1:]}{'' if value == 1 else 's'}"
        if not format_spec and isinstance(value, list | tuple):
            return ", ".join(map(str, value))
        return super().format_field(value, format_spec)


_FORMATTER = _Formatter()

#: code -> sentence; fields are names in ``values``.
SENTENCES: dict[str, str] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
