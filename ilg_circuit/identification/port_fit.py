"""Fits one electrical model of the port to all currents and spectra of a strip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..errors import IlgError, InputError, NotDetermined, SolveError, argument
from ..fit.fitting import fit, fit_near, with_starts
from ..fit.identifiability import Identifiability, diagnose
from ..fit.multistart import StartSummary
from ..fit.problem import Problem, Progress
from ..fit.reported import correlated
from ..fit.result import FitResult
from ..fit.selection import EVIDENCE
from ..strip.models import ElectricalModel, Ladders, electrical_model
from ..strip.port import Port
from .current import CurrentData
from .lack_of_fit import Lack, lack_of_fit
from .open_path import UNSEEN_PATH, seen_or_open, told
from .port_model import BY_TIME, DC, IndividualFit, PortData, PortModel, port_problem, sigma_of
from .port_start import suggestions

#: Model of an individual fit if the file alone does not determine the requested one.
SIMPLEST = "rc"
#: Relative difference of levels below which they do not show a nonlinearity.
_SAME_VOLTAGE = 0.2
#: Number of starts, and relative difference of sums of squares below which two fits are the same.
_FITS, _SAME = 2, 1e-3
#: A joint fit is taken as the global minimum if its sum of squares is at most this factor times the individual fits'.
_AS_GOOD = 1.02
#: Ratio of joint to individual residuals below which weights are taken from the joint fit.
_WORTH = 0.7
#: Initial guess of Re, as a fraction of the smallest resistance in any file.
_LITTLE_RE = 0.1
#: Least rms of residuals used for weights, as a fraction of an observation's size.
NEGLIGIBLE = 1e-9


@dataclass(frozen=True, eq=False)
class PortFit:
    """The fit of one port to all files, each file's individual fit, and the port (mean of parameters per record).

    ``fixed`` gives the reasons why parameters were not fitted.
    """

    model: PortModel
    data: tuple[PortData, ...]
    individual: tuple[IndividualFit, ...]
    fit: FitResult
    fixed: Mapping[str, str] = field(default_factory=dict)
    unfelt: tuple[str, ...] = ()

    @property
    def kind(self) -> ElectricalModel:
        return self.model.kind

    @property
    def values(self) -> dict[str, float]:
        """The port's parameters by name, also those that were not fitted."""
        found = dict(self.fit.means)
        if DC in self.fixed:
            found[DC] = max(d.open_path() for d in self.data)
        return found

    @property
    def port(self) -> Port:
        """The port with ladders for the band that all files cover."""
        low, high = min(d.band[0] for d in self.data), max(d.band[1] for d in self.data)
        values = self.values
        if self.model.typical and len(self.data) == 1:
            ladders = self.kind.ladders(np.array(self.model.typical), self.data[0].band)
        else:
            ladders = Ladders((low, high))
        return self.model.port(np.array([values[name] for name in self.model.names]), ladders)

    def identifiability(self, *, profiles: bool = True) -> Identifiability:
        """Return which parameters of the port the data determine, by open ``profiles`` too."""
        return diagnose(self.fit, self.port.branches, self.unfelt, profiles=profiles, spared=self.spared)

    @property
    def spared(self) -> str:
        """The parameter that currents need not determine, if any: an electron path that may be open as well."""
        return DC if all(d.quantity == "current" and d.may_be_open(self.kind) for d in self.data) else ""

    @property
    def rms(self) -> Array:
        """Root mean square of the residuals of each file (files,), in its unit."""
        return np.array([self.fit.rms_of(k) for k in range(len(self.data))])

    @property
    def misfit(self) -> float:
        """The geometric mean over all files of the rms relative to each file's size."""
        sizes = np.array([d.size for d in self.data])
        return float(np.exp(np.mean(np.log(np.maximum(self.rms / sizes, NEGLIGIBLE)))))

    def independent(self) -> Array:
        """Return the effective number of independent samples (files,) of the residuals."""
        return np.array([self.fit.independent_samples(k) for k in range(len(self.data))])

    @property
    def only_noise(self) -> bool:
        """True if no file's residuals follow its drive or exceed its individual fit's; or if all are only rounding."""
        if all(rms <= NEGLIGIBLE * d.size for rms, d in zip(self.rms, self.data, strict=True)):
            return True
        lack = self.lack or Lack()
        if lack.anything or (correlated(self.fit) and not lack.coloured):
            return False
        return self.beyond_individual(self.independent()) < EVIDENCE

    @cached_property
    def lack(self) -> Lack | None:
        """What the model lacks by the residuals of every file over time; None where that is not known."""
        return Lack.of_any(
            lack_of_fit(
                d.since, d.drive, self.fit.residuals[part], self.fit.slopes[part], by_current=d.response.by_current
            )
            for d, part in zip(self.data, self.fit.problem.slices, strict=False)  # displacements may come after them
            if isinstance(d, CurrentData)
        )

    def beyond_individual(self, samples: Array) -> float:
        """Return the BIC minus the BIC of all individual fits, which have more parameters, on ``samples`` (files,)."""
        rms = np.array([max(i.rms, NEGLIGIBLE * d.size) for i, d in zip(self.individual, self.data, strict=True)])
        gain = 2 * float(samples @ np.log(np.maximum(self.rms / rms, 1e-300)))
        more = sum(i.fit.count for i in self.individual) - self.fit.count
        return gain - more * float(np.log(samples.sum()))


def fit_port(
    data: Sequence[PortData],
    model: str,
    held: float | None,
    per_record: frozenset[str] = frozenset(),
    progress: Progress = None,
) -> PortFit:
    """Return the fit of ``model`` to all data, Re ``held`` [ohm] or, None, fitted too.

    ``per_record`` names parameters that have a value for each file. Raises InputError for a model that is not suitable
    for these data, SolveError if they do not determine its parameters.
    """
    kind = electrical_model(model)
    require_suitable(kind, data)
    if held is None and kind.linear:
        raise InputError(
            f"model {model} with Re fitted: no current and no spectrum of a linear port determines Re, since for every "
            "Re below its resistance at high frequency other elements make the same port; give a value, or a +sinh or "
            "+growing model and several voltages"
        )
    unknown = per_record - {p.name for p in PortModel(kind, held).parameters}
    if unknown:
        raise InputError(
            f"model {model} has no {', '.join(sorted(unknown))} that could be each record's own; it has "
            f"{', '.join(PortModel(kind, held).names)}"
        )
    start_re = _LITTLE_RE * _least_resistance(data) if held is None else held
    if len(data) == 1 and held is not None:
        only = data[0].individual(kind, held, progress)
        return PortFit(only.model, (only.data,), (only,), only.fit, only.fixed, only.unfelt)
    individual = tuple(_individual(d, kind, start_re, progress) for d in data)
    data = tuple(i.data for i in individual)
    if not any(DC in i.values for i in individual):  # an electron path that no file shows is no file's own
        per_record -= {DC}

    def jointly(opened: bool) -> PortFit:
        started = suggestions(kind, data, individual, opened=opened)
        if not started:
            lost = [name for name in kind.names if not any(name in i.values for i in individual)]
            raise NotDetermined(
                f"these data do not determine every parameter of model {model}, so that its fit has no start", lost
            )
        description = PortModel(kind, held, tuple(_slowest(kind, started).tolist()), opened)
        if held is None:
            started = [np.append(v, start_re) for v in started]
        return PortFit(
            description, data, individual, _weighted(data, individual, description, per_record, started, progress)
        )

    if DC in per_record or not all(d.may_be_open(kind) for d in data):
        return jointly(False)
    found = seen_or_open(jointly, lambda found: found.fit)
    return replace(found, fixed={DC: UNSEEN_PATH}) if found.model.opened else found


def on_all_rows(found: PortFit, progress: Progress = None) -> PortFit:
    """Return the fit of all rows, where ``found`` is a trial fit of some of them; an open path with its bound."""
    whole = _of_all_rows(found, progress)
    return replace(whole, fixed={DC: told(whole.fit, whole.data)}) if whole.model.opened else whole


def _of_all_rows(found: PortFit, progress: Progress) -> PortFit:
    """Return the fit of all rows, which is the trial fit if that has them."""
    data = tuple(d.whole for d in found.data)
    if all(len(d.data) == len(few.data) for d, few in zip(data, found.data, strict=True)):
        return found
    individual = tuple(_on_all_rows(i, d, progress) for i, d in zip(found.individual, data, strict=True))
    if len(data) == 1:
        return replace(found, data=data, individual=individual, fit=individual[0].fit)
    sigmas = [o.sigma for o in found.fit.problem.observations]
    pairs = zip(data, sigmas, strict=True)
    observations = tuple(d.observation(found.model, sigma) for d, sigma in pairs)
    again = fit_near(replace(found.fit.problem, observations=observations), found.fit.values, progress)
    return replace(found, data=data, individual=individual, fit=with_starts(again, found.fit.starts))


def _on_all_rows(found: IndividualFit, data: PortData, progress: Progress) -> IndividualFit:
    if len(data.data) == len(found.data.data):
        return found
    again = fit_near(port_problem((data,), found.model, (1.0,)), found.fit.values, progress)
    return replace(found, data=data, fit=with_starts(again, found.fit.starts))


def require_suitable(kind: ElectricalModel, data: Sequence[PortData]) -> None:
    """Raise InputError if these data do not determine an element of a model, or their engine cannot solve it."""
    if kind.spectra_only and all(d.quantity in BY_TIME for d in data):
        hidden = ", ".join(kind.spectra_only)
        raise InputError(f"model {kind.name}: only a spectrum shows {hidden}; leave it out, or add a spectrum")
    if not kind.linear and any(d.engine == "exact" for d in data):
        exact = argument("engine", "exact")
        raise InputError(f"model {kind.name} is nonlinear, and {exact} solves linear circuits; leave it out")
    if kind.linear or levels_differ(data):
        return
    unknown = " and ".join(name for name in kind.names if name in kind.needs_several_voltages)
    raise InputError(
        f"model {kind.name} needs several voltages, and all of these are at about {abs(data[0].voltage):.3g} V, where "
        f"{unknown} cannot be distinguished from a linear port's parameters; give files of different "
        "voltages, a waveform, or another model"
    )


def levels_differ(data: Sequence[PortData]) -> bool:
    """Return True if steps and biases differ, or a waveform covers many voltages."""
    levels = [d.level for d in data]
    sizes = [abs(level) for level in levels if level is not None]
    return len(sizes) < len(levels) or max(sizes) > (1 + _SAME_VOLTAGE) * min(sizes)


def _slowest(kind: ElectricalModel, started: list[Array]) -> Array:
    """Return the start with the longest diffusion time, for which ladders are designed."""
    at = kind.names.index("diffusion_time") if "diffusion_time" in kind.names else 0
    return max(started, key=lambda values: float(values[at]))


def _individual(d: PortData, kind: ElectricalModel, held: float, progress: Progress) -> IndividualFit:
    """Return the individual fit of the model, of its linear part or of the simplest: the first that can be fitted."""
    models = [m for m in (kind.name, kind.plain, SIMPLEST) if d.holds(electrical_model(m))]
    for model in dict.fromkeys(models[:-1]):
        try:
            return d.individual(electrical_model(model), held, progress)
        except (InputError, SolveError):
            continue
    try:
        return d.individual(electrical_model(SIMPLEST), held, progress)
    except IlgError as error:
        raise type(error)(f"{d.source}: {error}") from None


def _least_resistance(data: Sequence[PortData]) -> float:
    """Return the smallest resistance [ohm] in any file: voltage over peak current, or the spectrum's real part."""
    found = []
    for d in data:
        shown = d.shown(d.data)
        found.append(float(np.abs(shown.real).min()) if d.quantity == "impedance" else abs(d.voltage) / d.size)
    return min(found)


def _weighted(
    data: tuple[PortData, ...],
    individual: Sequence[IndividualFit],
    model: PortModel,
    per_record: frozenset[str],
    started: list[Array],
    progress: Progress,
) -> FitResult:
    """Return the best fit, with the residuals of every file divided by the rms of its individual fit.

    If the joint fit's residuals are much smaller, as may happen for a nonlinear model, the fit is repeated with weights
    from these.
    """
    sigmas = tuple(sigma_of(i.fit, d.size) for d, i in zip(data, individual, strict=True))
    alone = sum(len(d.data) * (i.rms / s) ** 2 for d, i, s in zip(data, individual, sigmas, strict=True))
    found = _best(port_problem(data, model, sigmas, per_record), model.kind, started, alone, progress)
    rms = [found.rms_of(k) for k in range(len(data))]
    if any(r < _WORTH * i.rms for r, i in zip(rms, individual, strict=True)):
        pairs = zip(data, individual, rms, strict=True)
        sigmas = tuple(sigma_of(i.fit, d.size, min(i.rms, r)) for d, i, r in pairs)
        again = fit(port_problem(data, model, sigmas, per_record), found.values, progress)
        found = with_starts(again, found.starts)
    return found


def _best(problem: Problem, kind: ElectricalModel, started: list[Array], alone: float, progress: Progress) -> FitResult:
    """Return the best of the fits from the most promising starts; the first if it cannot be improved.

    ``alone`` is the sum of squares of the individual fits, in the same units.
    """
    at = {p.name: k for k, p in enumerate(problem.parameters)}
    starts = [np.array([values[at[p.name]] for p in problem.moved]) for values in started]
    ranked = sorted(((_cost(problem, s), k) for k, s in enumerate(starts)), key=lambda pair: pair[0])
    chosen: list[tuple[float, int]] = []
    for cost, k in ranked:
        if np.isfinite(cost) and all(abs(cost - other) > _SAME * other for other, _ in chosen):
            chosen.append((cost, k))
    fits: list[FitResult] = []
    failure: IlgError | None = None
    tried = chosen[:_FITS] or [(0.0, 0)]
    for _, k in tried:
        try:
            fits.append(_ordered_fit(problem, kind, starts[k], progress))
        except IlgError as error:
            failure = failure or error
            continue
        if fits[-1].sum_of_squares <= _AS_GOOD * alone:
            break
    if not fits:
        assert failure is not None
        raise failure
    best = min(fits, key=lambda found: found.rmse)
    agreeing = sum(found.rmse <= best.rmse * (1 + _SAME) for found in fits)
    as_good = best.sum_of_squares <= _AS_GOOD * alone
    return with_starts(best, StartSummary(len(tried), max(agreeing, 2) if as_good else agreeing))


def _cost(problem: Problem, start: Array) -> float:
    """Return the sum of squares at ``start`` (n,); infinite if there is no solution."""
    try:
        return float(problem.sum_of_squares(problem.scales.coordinates(start)[None])[0])
    except IlgError:
        return float("inf")


def _ordered_fit(problem: Problem, kind: ElectricalModel, start: Array, progress: Progress) -> FitResult:
    """Return the fit with interchangeable branches in order of time constant, repeated if they have crossed."""
    found = fit(problem, start, progress)
    means = np.array([found.means[name] for name in kind.names])
    order = kind.order(means)
    if np.array_equal(order, np.arange(len(order))) or problem.per_record:
        return found
    moved = dict(zip(kind.names, means[order].tolist(), strict=True))
    again = np.array([moved.get(label, v) for label, v in zip(found.labels, found.values.tolist(), strict=True)])
    return fit(problem, again, progress)
