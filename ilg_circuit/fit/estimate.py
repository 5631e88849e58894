"""A fitted or derived quantity: value, unit, and how far it can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal

Method = Literal["covariance", "bootstrap", "profile", "mcmc"]


@dataclass(frozen=True)
class Parameter:
    """A value with its unit, standard error and 95 % interval; ``held`` says why it was not fitted, if it was not.

    ``bootstrap`` is the standard error, ``ci95_bootstrap`` the interval, of the block bootstrap, made where
    neighbouring residuals are alike; ``ci95_profile`` (0 or infinite where open) and ``ci95_mcmc`` where asked for.
    ``method`` is the one whose interval is to be believed, ``note`` what is to be said of it.
    """

    value: float
    unit: str
    stderr: float | None = None
    ci95: tuple[float, float] | None = None
    held: str = ""
    bootstrap: float | None = None
    ci95_bootstrap: tuple[float, float] | None = None
    ci95_profile: tuple[float, float] | None = None
    ci95_mcmc: tuple[float, float] | None = None
    method: Method = "covariance"
    note: str = ""

    @property
    def honest(self) -> tuple[float, tuple[float, float]]:
        """Standard error, the bootstrap's where there is one, and the interval of ``method``."""
        error = self.stderr if self.bootstrap is None else self.bootstrap
        interval = self.ci95 if self.method == "covariance" else getattr(self, f"ci95_{self.method}")
        assert error is not None
        assert interval is not None
        return error, interval

    def to_json(self) -> dict[str, Any]:
        entry: dict[str, Any] = {
            "value": self.value,
            "stderr": self.stderr,
            "unit": self.unit,
            "ci95": _json(self.ci95),
        }
        if self.bootstrap is not None:
            entry["stderr_bootstrap"] = self.bootstrap
        for method in ("bootstrap", "profile", "mcmc"):
            interval = getattr(self, f"ci95_{method}")
            if interval is not None:
                entry[f"ci95_{method}"] = _json(interval)
        if self.stderr is not None:
            entry["method"] = self.method
        if self.note:
            entry["method_note"] = self.note
        return entry | ({"held": self.held} if self.held else {})


def _json(interval: tuple[float, float] | None) -> list[float | None] | None:
    """An interval with null for an end that is not there."""
    if interval is None:
        return None
    low, high = interval
    return [low, high if isfinite(high) else None]
