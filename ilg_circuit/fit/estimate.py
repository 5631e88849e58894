"""Estimates: fitted or derived quantities with units, standard errors and intervals."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from ..errors import unknown_name
from ..result import Column
from ..units import format_quantity

Method = Literal["covariance", "bootstrap", "profile", "mcmc", "autoregression"]
Interval = tuple[float, float]
#: Fields of an estimate that are intervals.
INTERVALS = ("ci95", "ci95_autoregression", "ci95_bootstrap", "ci95_profile", "ci95_mcmc")


@dataclass(frozen=True, repr=False)
class Estimate:
    """An estimate of a parameter: value, unit, standard error and 95 % interval.

    Attributes
    ----------
    value : float
        The value [SI].
    unit : str
        SI unit.
    stderr : float or None
        Standard error by the covariance matrix, which takes residuals as independent; None for a fixed parameter.
    interval : tuple of float or None
        The 95 % interval that is reported, made by ``method``.
    fixed_because : str
        Why the parameter was not fitted, empty if it was.
    ci95 : tuple of float or None
        95 % interval by the covariance matrix.
    autoregression, ci95_autoregression
        Standard error and interval that allow for autocorrelated residuals.
    bootstrap, ci95_bootstrap
        Standard error and interval of the block bootstrap.
    ci95_profile, ci95_mcmc
        Intervals of the profile likelihood (0 or infinite where open), if it was asked for or slopes do not tell the
        ends, and of MCMC, if it was asked for.
    method : str
        Method of the reported interval.
    note : str
        A remark on the reported interval.
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

    @classmethod
    def from_dict(cls, entry: Mapping[str, Any]) -> Estimate:
        """Return the estimate of an entry of fit.json, see `to_dict`."""
        return cls(
            value=entry["value"],
            unit=entry["unit"],
            stderr=entry["stderr"],
            ci95=_interval(entry["ci95"]),
            fixed_because=entry.get("held", ""),
            bootstrap=entry.get("stderr_bootstrap"),
            ci95_bootstrap=_interval(entry.get("ci95_bootstrap")),
            ci95_profile=_interval(entry.get("ci95_profile")),
            ci95_mcmc=_interval(entry.get("ci95_mcmc")),
            autoregression=entry.get("stderr_autoregression"),
            ci95_autoregression=_interval(entry.get("ci95_autoregression")),
            method=entry.get("method", "covariance"),
            note=entry.get("method_note", ""),
        )

    @property
    def negated(self) -> Estimate:
        """The estimate of the negative of its quantity."""

        def turned(interval: Interval | None) -> Interval | None:
            return None if interval is None else (-interval[1], -interval[0])

        return replace(
            self,
            value=-self.value,
            ci95=turned(self.ci95),
            ci95_bootstrap=turned(self.ci95_bootstrap),
            ci95_profile=turned(self.ci95_profile),
            ci95_mcmc=turned(self.ci95_mcmc),
            ci95_autoregression=turned(self.ci95_autoregression),
        )

    @property
    def reported(self) -> tuple[float, Interval]:
        """Standard error, allowing for autocorrelation if that was estimated, and interval of ``method``."""
        errors = (self.bootstrap if self.method == "bootstrap" else self.autoregression, self.bootstrap, self.stderr)
        error = next((e for e in errors if e is not None), None)
        interval = self.ci95 if self.method == "covariance" else getattr(self, f"ci95_{self.method}")
        assert error is not None
        assert interval is not None
        return error, interval

    @property
    def interval(self) -> Interval | None:
        """The reported 95 % interval; None for a quantity that was held or is not determined."""
        return None if self.stderr is None or self.ci95 is None else self.reported[1]

    @property
    def quoted(self) -> Estimate:
        """The estimate with the reported standard error as its ``stderr``, which allows for autocorrelation."""
        return self if self.interval is None else replace(self, stderr=self.reported[0])

    def __repr__(self) -> str:
        """Return value, standard error and interval with units, those that there are, or why it was held."""
        value, interval = format_quantity(self.value, self.unit, 6), self.interval
        if self.stderr is None or (interval is None and self.fixed_because):
            return f"<Estimate {value}, {self.fixed_because or 'error not known'}>"
        if interval is None:
            return f"<Estimate {value}, standard error {format_quantity(self.stderr, self.unit, 2)}>"
        error, (low, high) = format_quantity(self.reported[0], self.unit, 2), interval
        ends = f"{format_quantity(low, self.unit, 5)} to {format_quantity(high, self.unit, 5)}"
        return f"<Estimate {value}, standard error {error}, 95 % interval {ends}>"

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of fit.json; an open end of an interval is null."""
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


class Estimates(dict[str, Estimate]):
    """Estimates by name; a missing name raises InputError, which lists the names."""

    def __missing__(self, name: str) -> Estimate:
        raise unknown_name("parameter", str(name), self)


class Estimated(ABC):
    """Mixin of results that have estimates: by name, and as a table."""

    @abstractmethod
    def estimate_tables(self) -> Mapping[str, Mapping[str, Estimate]]:
        """Return kind -> name -> estimate."""

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of that name, with ``value``, ``stderr``, ``interval`` and ``unit``.

        ``stderr`` is the reported one, which allows for autocorrelated residuals. Raises InputError, which lists the
        names, for a missing name.

        >>> import numpy as np
        >>> from ilg_circuit.fit.curve import fit_curve
        >>> fit = fit_curve(lambda x, a: a * x, np.array([1.0, 2.0, 3.0]), [2.1, 3.9, 6.0], [1.0], names=("a",))
        >>> fit["a"], round(fit["a"].value, 3), "b" in fit
        (<Estimate 1.99286, standard error 0.026, 95 % interval 1.8799 to 2.1058>, 1.993, False)
        """
        known = ChainMap(*map(dict, self.estimate_tables().values()))
        if name not in known:
            raise unknown_name("parameter", str(name), self)
        return known[name].quoted

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def __iter__(self) -> Iterator[str]:
        """Yield the names."""
        for found in self.estimate_tables().values():
            yield from found

    def table(self) -> tuple[Column, ...]:
        """Return one row per estimate."""
        return estimate_table(self.estimate_tables())


def estimate_table(tables: Mapping[str, Mapping[str, Estimate]]) -> tuple[Column, ...]:
    """Return estimates (kind -> name -> estimate) as a table."""
    rows = [(kind, name, e.quoted) for kind, table in tables.items() for name, e in table.items()]
    ends = [e.interval or (None, None) for _, _, e in rows]
    return (
        Column("parameter", [name for _, name, _ in rows], over=True),
        Column("kind", [kind for kind, _, _ in rows]),
        Column("value", [e.value for *_, e in rows]),
        Column("stderr", [e.stderr for *_, e in rows]),
        Column("low", [low for low, _ in ends]),
        Column("high", [high for _, high in ends]),
        Column("unit", [e.unit for *_, e in rows]),
        Column("held", [e.fixed_because for *_, e in rows]),
    )


def _interval(ends: Sequence[float | None] | None) -> Interval | None:
    """Return an interval from the two ends in fit.json, where an open end is null."""
    return None if ends is None else (ends[0] or 0.0, math.inf if ends[1] is None else ends[1])


def _plain(interval: Interval | None) -> list[float | None] | None:
    return interval and [interval[0], interval[1] if math.isfinite(interval[1]) else None]
