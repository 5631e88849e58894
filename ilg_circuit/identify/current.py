"""The electrical fit: rc and rc2 to a measured current."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..circuit.strip import electrical_netlist
from ..errors import InputError
from ..solve.transient import transient
from ..units import format_quantity
from .least_squares import Fit, fit_circuit
from .measurement import Measurement, noise_level
from .residuals import effective_samples, information_criterion, structured
from .start import current_start

Array = NDArray[np.float64]

BRANCHES = {"rc": 1, "rc2": 2}

#: Residuals below this part of the peak are of no interest, whatever their structure.
_NEGLIGIBLE = 1e-4
#: A parameter whose standard error exceeds this part of it is not determined by the data.
_DETERMINED = 0.5


@dataclass(frozen=True)
class CurrentFit:
    """Fit of one electrical model. ``time`` [s] since the onset, ``data`` and ``fitted`` [A], all (samples,).

    ``branches`` are (resistance [ohm], capacitance [F]) by ascending time constant; ``offset`` [A] is the instrument's,
    where one was found at rest.
    """

    model: str
    fit: Fit
    dc_resistance: float
    branches: tuple[tuple[float, float], ...]
    time: Array
    data: Array
    offset: float | None
    warnings: tuple[str, ...]

    @property
    def fitted(self) -> Array:
        return self.data - self.fit.residuals

    @property
    def determined(self) -> bool:
        """Whether the data determine every parameter, the branches being distinct."""
        constants = [r * c for r, c in self.branches]
        distinct = all(b > 1.5 * a for a, b in pairwise(constants))
        return distinct and bool((self.fit.errors <= _DETERMINED * self.fit.values).all())

    def effective_bic(self, simplest: CurrentFit) -> float:
        """BIC on as many samples as are independent, by the better model's residuals; see `residuals`."""
        samples = max(effective_samples(self.fit.residuals), effective_samples(simplest.fit.residuals))
        return information_criterion(self.fit.residuals, self.fit.count, samples)


def fit_current(
    measurement: Measurement,
    electrode_resistance: float,
    model: str,
    engine: str = "ngspice",
    progress: Callable[[], None] | None = None,
) -> CurrentFit:
    """Fit ``model`` to the measured current, Re held [ohm]. Raises InputError or SolveError as `identify` says."""
    if model not in BRANCHES:
        raise InputError(f"model is '{model}'; choose one of {', '.join(BRANCHES)}")
    channel, drive = measurement.current, measurement.drive
    rest = channel.rest
    offset = _rest_offset(channel.values[rest])
    keep = np.ones(len(rest), dtype=bool) if offset is not None else ~rest
    t, data = channel.time[keep], channel.values[keep]
    after = t >= 0
    dc, pairs = current_start(t[after], data[after] - (offset or 0.0), drive, electrode_resistance, BRANCHES[model])

    def waves(values: Array) -> Array:
        netlists = [
            electrical_netlist(v[0], tuple(zip(v[1::2], v[2::2], strict=True)), electrode_resistance)
            for v in values.tolist()
        ]
        result = np.zeros((len(values), len(t)))
        result[:, after] = transient(netlists, drive, t[after], engine=engine).values[:, 0]
        return result

    start = np.array([dc, *(x for pair in pairs for x in pair)])
    nuisance = np.ones((len(t), 1)) if offset is not None else None
    fit = fit_circuit(waves, data, _names(model), start, nuisance, progress)
    fit, branches = _sorted(fit)
    return CurrentFit(
        model=model,
        fit=fit,
        dc_resistance=float(fit.values[0]),
        branches=branches,
        time=t,
        data=data,
        offset=float(fit.nuisance[0]) if offset is not None else None,
        warnings=(*_warnings(model, fit, data), *_resolution_warnings(fit, data)),
    )


def _names(model: str) -> tuple[str, ...]:
    if model == "rc":
        return ("dc_resistance", "dynamic_resistance", "capacitance")
    branches = range(1, BRANCHES[model] + 1)
    return ("dc_resistance", *(f"{what}_{k}" for k in branches for what in ("resistance", "capacitance")))


def _rest_offset(rest: Array) -> float | None:
    """Mean current at rest, where it is beyond chance; None otherwise."""
    if len(rest) < 5:
        return None
    mean, spread = float(rest.mean()), float(rest.std(ddof=1))
    return mean if abs(mean) > 4 * spread / np.sqrt(len(rest)) and mean else None


def _sorted(fit: Fit) -> tuple[Fit, tuple[tuple[float, float], ...]]:
    """The fit with its branches by ascending time constant (a sum of branches is unique up to their order)."""
    pairs = fit.values[1:].reshape(-1, 2)
    order = np.argsort(pairs.prod(axis=1))
    index = np.concatenate([[0], *([2 * k + 1, 2 * k + 2] for k in order)]).astype(int)
    everything = np.concatenate([index, np.arange(len(index), fit.count)])
    arranged = Fit(
        fit.names,
        fit.values[index],
        fit.errors[index],
        fit.covariance[np.ix_(everything, everything)],
        fit.nuisance,
        fit.nuisance_errors,
        fit.residuals,
        fit.aic,
        fit.bic,
        fit.evaluations,
    )
    return arranged, tuple((float(r), float(c)) for r, c in arranged.values[1:].reshape(-1, 2))


def _warnings(model: str, fit: Fit, data: Array) -> tuple[str, ...]:
    found = []
    peak = float(np.abs(data).max())
    if structured(fit.residuals) and fit.rmse > max(1.5 * noise_level(data), _NEGLIGIBLE * peak):
        share = f"{fit.rmse / peak:.1%} of the peak current rms"
        if model == "rc":
            found.append(f"one pole is not enough: the residuals ({share}) have a structure; try --model rc2")
        else:
            found.append(f"the residuals ({share}) still have a structure that two branches do not hold")
        found.append(
            "residuals of neighbouring samples are alike: the standard errors, which take them as independent, are too "
            "small"
        )
    loose = [n for n, v, e in zip(fit.names, fit.values, fit.errors, strict=True) if e > _DETERMINED * v]
    if loose:
        found.append(f"not determined by these data (standard error over {_DETERMINED:.0%}): {', '.join(loose)}")
    return tuple(found)


def _resolution_warnings(fit: Fit, data: Array) -> list[str]:
    """What a coarse instrument leaves open beyond the standard errors."""
    found = []
    steps = np.diff(np.unique(data))
    if len(steps) and float(steps.min()) > 2 * fit.rmse and len(steps) < len(data) / 4:
        found.append(
            f"the current's resolution of {format_quantity(float(steps.min()), 'A', 2)} is coarser than the residuals: "
            "what lies below it, such as the steady current, is not known as well as the standard errors say"
        )
    return found
