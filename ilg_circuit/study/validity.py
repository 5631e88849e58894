"""Findings about the model's assumptions at the scenarios of a study."""

from __future__ import annotations

from collections.abc import Iterable

from ..findings import Finding
from ..strip.validity import deflection_warnings, run_warnings
from .parameters import Scenario


def run_findings(scenario: Scenario, displacement: float | None) -> list[Finding]:
    """Return the assumptions that fail in a run that reaches ``displacement`` [m] in size (None: unknown)."""
    drive = scenario.drive
    return _findings(run_warnings(scenario.actuator, drive, scenario.duration, drive.largest(), displacement))


def deflection_findings(bent: int) -> list[Finding]:
    """Return the finding that ``bent`` of several designs exceed the small-deflection limit, if any do."""
    return _findings(deflection_warnings(bent))


def _findings(texts: Iterable[str]) -> list[Finding]:
    return [Finding("assumption-fails", values={"text": text}) for text in texts]
