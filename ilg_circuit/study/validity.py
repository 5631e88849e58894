"""Findings about the model's assumptions at the scenarios of a study."""

from __future__ import annotations

from collections.abc import Iterable

from ..findings import Finding
from ..strip.validity import deflection_warnings, run_warnings
from .parameters import Scenario


def run_findings(scenario: Scenario, displacement: float | None) -> list[Finding]:
    """Return the assumptions that fail in a run that reaches ``displacement`` [m] in size (None: unknown)."""
    run = scenario.drive, scenario.duration, scenario.drive.largest()
    return _findings(run_warnings(scenario.actuator, *run, displacement))


def deflection_findings(bent: int) -> list[Finding]:
    """Return the finding that ``bent`` of several designs exceed the small-deflection limit, if any do."""
    return _findings(deflection_warnings(bent))


def _findings(rows: Iterable[Finding | str]) -> list[Finding]:
    return [row if isinstance(row, Finding) else Finding("assumption-fails", values={"text": row}) for row in rows]
