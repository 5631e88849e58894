"""Estimates: a fitted or derived quantity with its unit and how far it can be trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

Method = Literal["covariance", "bootstrap", "profile", "mcmc", "autoregression"]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Estimate:
    """A value with its unit, standard error and 95 % interval; ``fixed_because`` says why it was not fitted.

    Where residuals are autocorrelated ``autoregression`` is the standard error, ``ci95_autoregression`` the interval,
    that allow for it, and ``bootstrap``, ``ci95_bootstrap`` those of the block bootstrap, which are never the wider
    ones; ``ci95_profile`` (0 or infinite where open) and ``ci95_mcmc`` are there where asked for. ``method`` names the
    interval that is reported, ``note`` what is to be said of it.
    """

    value: float
    unit: str
    stderr: float | None = None
    ci95: Interval | None = None
    fixed_because: str = ""
    bootstrap: float | None = None
    ci95_bootstrap: Interval | None = None
    ci95_profile: Interval | None = None
    ci95_mcmc: Interval | None = None
    autoregression: float | None = None
    ci95_autoregression: Interval | None = None
    method: Method = "covariance"
    note: str = ""

    @classmethod
    def from_logarithm(cls, value: float, unit: str, error: float) -> Estimate:
        """Return the estimate of a positive ``value`` whose logarithm has the standard ``error``."""
        factor = math.exp(1.96 * error)
        return cls(value, unit, value * error, (value / factor, value * factor))

    @property
    def reported(self) -> tuple[float, Interval]:
        """Standard error, the one that allows for autocorrelation where there is one, and interval of ``method``."""
        errors = (self.bootstrap if self.method == "bootstrap" else self.autoregression, self.bootstrap, self.stderr)
        error = next((e for e in errors if e is not None), None)
        interval = self.ci95 if self.method == "covariance" else getattr(self, f"ci95_{self.method}")
        assert error is not None
        assert interval is not None
        return error, interval

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of fit.json; an end of an interval that is open is null."""
        entry: dict[str, Any] = {
            "value": self.value,
            "stderr": self.stderr,
            "unit": self.unit,
            "ci95": _plain(self.ci95),
        }
        if self.bootstrap is not None:
            entry["stderr_bootstrap"] = self.bootstrap
        if self.autoregression is not None:
            entry["stderr_autoregression"] = self.autoregression
        for method in ("bootstrap", "profile", "mcmc", "autoregression"):
            interval = getattr(self, f"ci95_{method}")
            if interval is not None:
                entry[f"ci95_{method}"] = _plain(interval)
        if self.stderr is not None:
            entry["method"] = self.method
        if self.note:
            entry["method_note"] = self.note
        return entry | ({"held": self.fixed_because} if self.fixed_because else {})


def _plain(interval: Interval | None) -> list[float | None] | None:
    return interval and [interval[0], interval[1] if math.isfinite(interval[1]) else None]
