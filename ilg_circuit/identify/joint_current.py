"""The port from several data sets: one electrical model fitted to all currents and spectra of a strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError, InputError, SolveError
from ..fit.bootstrap import correlated
from ..fit.identifiability import DETERMINED
from ..fit.together import Parameters, Part, Together, fit_together, squares
from ..strip.models import ElectricalModel, Ladders, electrical_model
from ..strip.port import Port
from .datasets import Dataset, OwnFit, PortModel, Progress, sigma_of
from .joint_start import suggestions
from .selection import EVIDENCE

Array = NDArray[np.float64]

#: Levels that differ by less than this part tell nothing about a nonlinearity.
_SAME_VOLTAGE = 0.2
#: Fits run from so many starts; those whose sums of squares differ by less are the same.
_FITS, _SAME = 2, 1e-3
#: Of the sum of squares of the own fits a joint fit leaves no more than that where it has reached the least.
_AS_GOOD = 1.02
#: A joint fit that leaves less than that part of what an own fit leaves gives the better weight.
_WORTH = 0.7
#: A fitted Re starts at this part of the least resistance that any record shows.
_LITTLE_RE = 0.1
#: What a model leaves counts as no less than this part of a data set's size.
_NEGLIGIBLE = 1e-9


@dataclass(frozen=True)
class JointCurrent:
    """One port for all: the joint fit, each data set's own, and the port (own parameters: their geometric mean)."""

    model: PortModel
    datasets: tuple[Dataset, ...]
    own: tuple[OwnFit, ...]
    together: Together
    port: Port

    @property
    def determined(self) -> tuple[bool, str]:
        """Whether the data determine every parameter, and what not."""
        fit = self.together.fit
        loose = [n for n, v, e in zip(fit.names, fit.values, fit.errors, strict=True) if not e <= DETERMINED * v]
        if loose:
            return False, f"standard error over {DETERMINED:.0%}: {', '.join(loose)}"
        constants = [r * c for r, c in self.port.branches]
        distinct = all(b > 1.5 * a for a, b in pairwise(constants))
        return distinct, "" if distinct else "two of its branches are one"

    @property
    def rms(self) -> Array:
        """Of what the joint fit leaves of each data set (datasets,), in its unit."""
        return np.array(_rms(self.together))

    @property
    def misfit(self) -> float:
        """The same over each data set's size, the geometric mean of all."""
        sizes = np.array([d.size for d in self.datasets])
        return float(np.exp(np.mean(np.log(np.maximum(self.rms / sizes, _NEGLIGIBLE)))))

    def independent(self) -> Array:
        """Number of independent samples (datasets,) that the residuals amount to."""
        together = self.together
        return np.array([d.independent(together.residuals(k)) for k, d in enumerate(self.datasets)])

    @property
    def only_noise(self) -> bool:
        """Whether no data set leaves more than its own fit does, or anything but noise."""
        return not correlated(self.together.fit) and self.beyond_own(self.independent()) < EVIDENCE

    def beyond_own(self, samples: Array) -> float:
        """BIC of the joint fit above that of all own fits, which have more parameters, on ``samples`` (datasets,)."""
        own = np.array([max(o.rms, _NEGLIGIBLE * d.size) for o, d in zip(self.own, self.datasets, strict=True)])
        gain = 2 * float(samples @ np.log(np.maximum(self.rms / own, 1e-300)))
        more = sum(o.fit.count for o in self.own) - self.together.fit.count
        return gain - more * float(np.log(samples.sum()))

    def bic(self, samples: Array) -> float:
        """BIC with a variance of its own for each data set, which has ``samples`` (datasets,) independent ones.

        These variances do not depend on the weights of the fit, so that fits of different weights can be compared.
        """
        floor = [_NEGLIGIBLE * d.size for d in self.datasets]
        misfit = 2 * float(samples @ np.log(np.maximum(self.rms, floor)))
        return misfit + self.together.fit.count * float(np.log(samples.sum()))


def fit_port(
    datasets: Sequence[Dataset],
    model: str,
    held: float | None,
    own_names: frozenset[str] = frozenset(),
    progress: Progress = None,
) -> JointCurrent:
    """Fit ``model`` to all data sets, Re ``held`` [ohm] or, None, fitted too; ``own_names`` each has for itself.

    Raises InputError for a model that these data cannot hold, SolveError where they do not determine its parameters.
    """
    kind = electrical_model(model)
    require_levels(kind, datasets)
    start_re = _LITTLE_RE * _least_resistance(datasets) if held is None else held
    if held is None and kind.linear:
        raise InputError(
            f"model {model} with Re fitted: no current and no spectrum of a linear port determines Re, since for every "
            "Re below its resistance at high frequency other elements make the same port; give a value, or a +sinh or "
            "+growing model and several voltages"
        )
    own = tuple(d.own(kind, start_re, progress) for d in datasets)
    started = suggestions(kind, datasets, own)
    if not started:
        raise SolveError(f"these data do not determine every parameter of model {model}, so that its fit has no start")
    at = kind.names.index("diffusion_time") if "diffusion_time" in kind.names else 0
    ladder_start = max(started, key=lambda values: float(values[at]))
    description = PortModel(kind, held, tuple(ladder_start.tolist()))
    unknown = own_names - set(description.names)
    if unknown:
        raise InputError(
            f"model {model} has no {', '.join(sorted(unknown))} that could be each record's own; it has "
            f"{', '.join(description.names)}"
        )
    if held is None:
        started = [np.append(v, start_re) for v in started]
    parameters = Parameters(description.names, description.below, own_names)
    together = _weighted(datasets, own, description, parameters, started, progress)
    better = [replace(o, rms=min(o.rms, x)) for o, x in zip(own, _rms(together), strict=True)]
    if any(b.rms < _WORTH * o.rms for b, o in zip(better, own, strict=True)):
        # what is not linear is fitted better jointly: its weight is then by what the joint fit leaves
        again = [together.values(k) for k in range(len(datasets))]
        parts = [d.part(description, sigma_of(d, b)) for d, b in zip(datasets, better, strict=True)]
        together = fit_together(parts, parameters, np.array(again), progress)
    together = _in_order(together, kind)
    bands = [d.band for d in datasets]
    ladders = Ladders((min(low for low, _ in bands), max(high for _, high in bands)))
    return JointCurrent(description, tuple(datasets), own, together, description.port(together.mean, ladders))


def require_levels(kind: ElectricalModel, datasets: Sequence[Dataset]) -> None:
    """Raise InputError where a nonlinear model is to be fitted to data of one voltage."""
    if not kind.linear and not levels_differ(datasets):
        unknown = " and ".join(p.name for p in kind.parameters if p.name in ("emission_voltage", "capacitance_slope"))
        raise InputError(
            f"model {kind.name} needs several voltages, and all of these are at about "
            f"{abs(datasets[0].voltage):.3g} V, where {unknown} cannot be told from a linear port's parameters; give "
            "files of different voltages, a waveform, or another model"
        )


def levels_differ(datasets: Sequence[Dataset]) -> bool:
    """Whether steps and biases differ, or a waveform passes many voltages."""
    levels = [d.level for d in datasets]
    sizes = [abs(level) for level in levels if level is not None]
    return len(sizes) < len(levels) or max(sizes) > (1 + _SAME_VOLTAGE) * min(sizes)


def _least_resistance(datasets: Sequence[Dataset]) -> float:
    """The least resistance [ohm] that any data set shows: peak current per volt, or the spectrum's real part."""
    found = []
    for d in datasets:
        shown = d.shown(d.data)
        found.append(float(np.abs(shown.real).min()) if d.quantity == "impedance" else abs(d.voltage) / d.size)
    return min(found)


def _rms(together: Together) -> list[float]:
    return [float(np.sqrt(np.mean(together.residuals(k) ** 2))) for k in range(len(together.parts))]


def _weighted(
    datasets: Sequence[Dataset],
    own: Sequence[OwnFit],
    description: PortModel,
    parameters: Parameters,
    started: list[Array],
    progress: Progress,
) -> Together:
    """The best joint fit, every data set counted in units of what its own fit leaves."""
    parts = [d.part(description, sigma_of(d, o)) for d, o in zip(datasets, own, strict=True)]
    alone = sum(len(p.data) * (o.rms / p.sigma) ** 2 for p, o in zip(parts, own, strict=True))
    return _best(parts, parameters, started, alone, progress)


def _best(
    parts: Sequence[Part], parameters: Parameters, started: list[Array], alone: float, progress: Progress
) -> Together:
    """The better one of the fits from the most promising starts; no second one where nothing is left to gain.

    ``alone`` is the sum of squares that the own fits leave, in the same units.
    """
    ranked = sorted(((squares(parts, values), k) for k, values in enumerate(started)), key=lambda pair: pair[0])
    chosen: list[tuple[float, int]] = []
    for cost, k in ranked:
        if np.isfinite(cost) and all(abs(cost - other) > _SAME * other for other, _ in chosen):
            chosen.append((cost, k))
    best, problem = None, None
    for _, k in chosen[:_FITS] or [(0.0, 0)]:
        try:
            found = fit_together(parts, parameters, np.tile(started[k], (len(parts), 1)), progress)
        except IlgError as error:
            problem = problem or error
            continue
        if best is None or found.fit.rmse < best.fit.rmse:
            best = found
        if float(found.fit.residuals @ found.fit.residuals) <= _AS_GOOD * alone:
            break
    if best is None:
        assert problem is not None
        raise problem
    return best


def _in_order(together: Together, kind: ElectricalModel) -> Together:
    """Branches by ascending time constant: a sum of branches is unique up to their order."""
    names = list(kind.names)
    if "resistance_1" not in names:
        return together
    mean, places, fit = together.mean, together.places, together.fit
    count = sum(n.startswith("resistance_") for n in names)
    pairs = [(names.index(f"resistance_{k}"), names.index(f"capacitance_{k}")) for k in range(1, count + 1)]
    order = sorted(range(count), key=lambda k: mean[pairs[k][0]] * mean[pairs[k][1]])
    source = np.arange(fit.count)
    for to, came in enumerate(order):
        for a, b in zip(pairs[to], pairs[came], strict=True):
            if len(np.unique(places[:, a])) != len(np.unique(places[:, b])):
                return together  # of a pair that is own to each and one that is shared each keeps its name
            source[places[:, a]] = places[:, b]
    n = len(fit.values)
    arranged = replace(
        fit,
        values=fit.values[source[:n]],
        errors=fit.errors[source[:n]],
        covariance=fit.covariance[np.ix_(source, source)],
        slopes=fit.slopes[:, source],
    )
    return replace(together, fit=arranged)
