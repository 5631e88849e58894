"""Computes a strip's parameters and derived quantities with errors, and the covariance for predictions, from a fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..errors import IlgError, argument
from ..fit.estimate import Estimate
from ..fit.intervals import Uncertainties
from ..fit.quantiles import student
from ..fit.reported import reported_covariance, reported_freedom
from ..fit.result import FitResult
from ..simulation import closed_forms
from ..strip.actuator import Uncertainty
from ..units import format_quantity
from .current import CurrentData
from .displacement import DisplacementFit
from .impedance import ImpedanceData
from .motion_laws import MotionLaw
from .onset import Onsets
from .port_fit import PortFit
from .port_model import ANY_LADDER, DC, ELECTRODE_RESISTANCE, PortData

_STEP = 1e-4
#: Logarithmic slope below which a quantity does not depend on a parameter.
_UNFELT = 1e-6
#: Half-width of an interval of a logarithm above which it is wide.
_VAGUE = 0.2
#: Correlation with a profile's value above which a quantity goes with it.
_ALONG = 0.7
#: Change of a logarithm at the end of a profile without limit.
_OPEN = 13.0

Estimates = dict[str, Estimate]


def uncertainty_of(model: str, fit: FitResult, more: Array, voltage: float | None) -> Uncertainty:
    """Return the covariance of the logarithms of the parameters of ``fit``; parameters per record are averaged.

    ``more`` (n, n) is an additional covariance of the values, from quantities that the fit takes for known; ``voltage``
    [V] is the largest of the data.
    """
    names, averaging = fit.averaging
    relative = (reported_covariance(fit) + more) / np.outer(fit.values, fit.values)
    covariance = averaging @ relative @ averaging.T
    covariance = (covariance + covariance.T) / 2  # symmetric to the last digit
    return Uncertainty(model, names, tuple(map(tuple, covariance.tolist())), voltage)


def scattered(found: Uncertainty, law: MotionLaw, spread: Array, files: int) -> Uncertainty:
    """Return the covariance of a strip in a state like any of ``files``; the mean of the files is known to its part.

    ``spread`` (p, p) is the covariance of the logarithms of the law's parameters between the files.
    """
    at = [found.names.index(p.name) for p in law.parameters]
    covariance = np.array(found.covariance)
    covariance[np.ix_(at, at)] += (1 + 1 / files) * spread
    return replace(found, covariance=tuple(map(tuple, covariance.tolist())))


def parameter_estimates(
    fit: FitResult, port: PortFit | None, intervals: Uncertainties, uncertainty: Uncertainty
) -> tuple[Estimates, dict[str, Estimates]]:
    """Return the strip's parameters, and by file the parameters per file (whose geometric mean is the strip's)."""
    errors = dict(zip(uncertainty.names, np.sqrt(np.diag(np.array(uncertainty.covariance))).tolist(), strict=True))
    per_record = fit.problem.per_record
    values, fixed = (port.values, port.fixed) if port is not None else ({}, {})
    found: Estimates = {}
    own: dict[str, Estimates] = {}
    labelled = fit.problem.labelled
    for p in fit.problem.parameters:
        if p.name in fixed:
            found[p.name] = Estimate(values[p.name], p.unit, fixed_because=fixed[p.name])
        elif p.name not in per_record:
            found[p.name] = intervals.estimates[p.name]
            if p.name == DC:
                found[p.name] = _as_conductance(found[p.name])
        else:
            found[p.name] = Estimate.from_logarithm(fit.means[p.name], p.unit, errors[p.name])
            for source in dict.fromkeys(o.source for o in fit.problem.observations if p.name in o.names):
                label = f"{p.name}[{source}]"
                assert any(label == known for known, _ in labelled)
                own.setdefault(source, {})[p.name] = intervals.estimates[label]
    if port is not None and port.model.held is not None:
        electrode = Estimate(port.model.held, "ohm", fixed_because=_held_because(port))
        names = list(port.kind.names)
        before = {name: found.pop(name) for name in names}
        found = before | {ELECTRODE_RESISTANCE.name: electrode} | found
    return found, own


def with_signs(found: Estimates, law: MotionLaw) -> Estimates:
    """Return estimates with the signs of a law's gains, of which a fit has the sizes."""
    return {name: e.negated if name in law.negative else e for name, e in found.items()}


def _as_conductance(found: Estimate) -> Estimate:
    """Return a resistance whose intervals, where they are wide, reach as far as those of its conductance.

    A current is linear in the steady conductance, which may well be zero.
    """

    def reaching(interval: tuple[float, float] | None) -> tuple[float, float] | None:
        if interval is None:
            return None
        above = math.log(interval[1] / found.value)
        if above <= _VAGUE:
            return interval
        below = math.log(found.value / interval[0]) if interval[0] else math.inf
        return found.value / (1 + below), found.value / (1 - above) if above < 1 else math.inf

    return replace(
        found,
        ci95=reaching(found.ci95),
        ci95_autoregression=reaching(found.ci95_autoregression),
        ci95_bootstrap=reaching(found.ci95_bootstrap),
    )


def _held_because(port: PortFit) -> str:
    """Return the reason why Re was not fitted, and its effect."""
    how = "held at the value given" if port.model.held else "held at zero, since the electrodes are not described"
    if not port.kind.linear:
        return f"not fitted: {how} ({argument('electrode_resistance', 'fit')} frees it)"
    limit = port.port.high_frequency_resistance
    return f"no current or spectrum of a linear port fixes it (any Re below {limit:.4g} ohm fits as well): {how}"


def port_quantities(
    port: PortFit,
    fit: FitResult,
    uncertainty: Uncertainty,
    onsets: Onsets,
    ends: Mapping[str, Array],
    *,
    scattered: bool = False,
) -> Estimates:
    """Return the quantities derived from the port's parameters, with errors and 95 % intervals.

    They are the resistances at both ends of the spectrum, which do not depend on the choice of Re, the quantities that
    the model derives, such as time constants, and for one pole the constants of EC (4). Errors are propagated through
    the slopes of the logarithms. Intervals include the uncertainty of the onset as in `Onsets.widened`, with its
    correlations: an onset that changes R and C in opposite directions does not widen the interval of their product.
    Where parameters are ``scattered`` between files, they include that, too; else what goes with values whose intervals
    are profiles has an interval by the ``ends`` of these, see `Uncertainties`. What follows from held parameters alone
    has no error, and says so.
    """
    values, model = port.values, port.model
    names, averaging = fit.averaging
    at = [k for k, name in enumerate(names) if name in model.names]
    chosen, averaging = [names[k] for k in at], averaging[at]
    logs = np.log([values[name] for name in chosen])
    found = _following(port, dict(zip(chosen, np.exp(logs).tolist(), strict=True)))

    def logarithms(rows: Array) -> Array:
        every = (_following(port, dict(zip(chosen, np.exp(row).tolist(), strict=True))) for row in rows)
        return np.log([[value for value, _ in each.values()] for each in every])

    steps = _STEP * np.eye(len(logs))
    slopes = (logarithms(logs + steps) - logarithms(logs - steps)) / (2 * _STEP)
    order = [uncertainty.names.index(name) for name in chosen]
    covariance = np.array(uncertainty.covariance)[np.ix_(order, order)]
    errors = _lengths(slopes, covariance)
    own = averaging @ (reported_covariance(fit) / np.outer(fit.values, fit.values)) @ averaging.T
    noise, quantile = _lengths(slopes, own), _quantiles(fit, slopes.T @ averaging)
    reach = onsets.reach(noise, quantile, lambda x: logarithms(np.log(fit.problem.scales.values(x)) @ averaging.T))
    below, above = np.maximum(quantile * noise + reach, quantile * errors if scattered else 0.0)
    with np.errstate(over="ignore"):  # an end beyond all numbers is open
        low, high = np.exp(-below), np.exp(above)
    rows = zip(found.items(), errors.tolist(), low.tolist(), high.tolist(), strict=True)
    estimates = {
        name: Estimate(value, unit, value * error, (value * least, value * most))
        for (name, (value, unit)), error, least, most in rows
    }
    estimates["steady_resistance"] = _as_conductance(estimates["steady_resistance"])
    moved = (
        {} if scattered else _at_ends(fit, ends, names, lambda x: logarithms(x @ averaging.T) - logarithms(logs[None]))
    )
    if moved:
        spread = fit.covariance[: len(fit.values), : len(fit.values)] / np.outer(fit.values, fit.values)
        along = _correlations(slopes.T @ averaging, spread)[:, [fit.labels.index(label) for label in moved]]
        estimates = _by_profiles(estimates, np.concatenate(list(moved.values())), along, reach)
    held = "; ".join(f"as {name}: {reason}" for name, reason in port.fixed.items())
    for name, felt in zip(found, np.abs(slopes).max(axis=0) > _UNFELT, strict=True):
        if held and not felt:
            estimates[name] = Estimate(*found[name], fixed_because=held)
    return estimates


def _at_ends(
    fit: FitResult, ends: Mapping[str, Array], names: Sequence[str], of: Callable[[Array], Array]
) -> dict[str, Array]:
    """Return by label what ``of`` computes from the logarithms (2, n) of values at the ends of profiles.

    Profiles of other parameters than ``names`` are left out, and what ends where no circuit is: at a parameter's limit.
    """
    found = {}
    for label, x in ends.items():
        with suppress(IlgError):
            if label in names:
                found[label] = of(np.log(fit.problem.scales.values(x)))
    return found


def _by_profiles(estimates: Estimates, moved: Array, along: Array, reach: Array) -> Estimates:
    """Return quantities (m,) with intervals by the ends of profiles where they go with the profiles' values.

    ``moved`` (2 g, m) are the changes of their logarithms at both ends of g profiles, ``along`` (m, g) the correlations
    with the profiles' values, and ``reach`` (2, m) what uncertain onsets add. Where all is linear, the most correlated
    profile's ends have the correlation's part of the quantity's interval.
    """
    found = dict(estimates)
    for k, (name, e) in enumerate(estimates.items()):
        share = float(np.abs(along[k]).max())
        if share > _ALONG and e.ci95 is not None:
            below = max(-moved[:, k].min(), 0.0) / share + reach[0, k]
            above = max(moved[:, k].max(), 0.0) / share + reach[1, k]
            low, high = (math.exp(-below) if below < _OPEN else 0.0), (math.exp(above) if above < _OPEN else math.inf)
            found[name] = replace(e, ci95_profile=(e.value * low, e.value * high), method="profile")
    return found


def _correlations(rows: Array, covariance: Array) -> Array:
    """Return the correlations (m, n) of linear combinations ``rows`` (m, n) of values with these."""
    sizes = np.outer(_lengths(rows.T, covariance), np.sqrt(np.diag(covariance)))
    return np.divide(rows @ covariance, sizes, out=np.zeros_like(sizes), where=sizes > 0)


def _following(port: PortFit, moved: dict[str, float]) -> dict[str, tuple[float, str]]:
    """Return the values and units of the derived quantities, with some of the port's parameters ``moved``."""
    values = {**port.values, **moved}
    made = port.model.port(np.array([values[name] for name in port.model.names]), ANY_LADDER)
    found = {
        "steady_resistance": (made.steady_resistance, "ohm"),
        "high_frequency_resistance": (made.high_frequency_resistance, "ohm"),
        **port.kind.derived([values[name] for name in port.kind.names]),
    }
    if len(made.branches) == 1 and made.linear:
        constants = closed_forms.current_constants(made.dc_resistance, *made.branches[0], made.electrode_resistance)
        units = {"steady_conductance": "S", "transient_conductance": "S", "rate": "1/s"}
        found |= {name: (v, unit) for (name, unit), v in zip(units.items(), constants, strict=True)}
    return found


def _lengths(slopes: Array, covariance: Array) -> Array:
    """Return the standard errors (m,) of quantities with ``slopes`` (n, m) against values of ``covariance`` (n, n)."""
    return np.sqrt(np.maximum(np.einsum("nm,nk,km->m", slopes, covariance, slopes), 0.0))


def _quantiles(fit: FitResult, slopes: Array) -> Array:
    """Return Student's 95 % quantiles (m,) of quantities with ``slopes`` (m, n) against the values of ``fit``.

    The degrees of freedom are the fewest among the values that a quantity depends on.
    """
    freedom = np.where(np.abs(slopes) > _UNFELT, reported_freedom(fit), np.inf).min(axis=1)
    return np.asarray(student(0.975, freedom))


def file_quantities(data: PortData, fit: FitResult, k: int) -> Estimates:
    """Return the quantities derived from one file of port data, observation ``k`` of ``fit``."""
    if isinstance(data, ImpedanceData):
        f = data.abscissa
        ends = {"lowest_frequency": float(f[0]), "highest_frequency": float(f[-1])}
        return {name: Estimate(value, "Hz") for name, value in ends.items()}
    assert isinstance(data, CurrentData)
    found = {"onset": Estimate(data.record.onset, "s")}
    if data.record.step is not None:
        found["step_voltage"] = Estimate(data.record.step, "V")
    if data.has_offset:
        found[f"{data.quantity}_offset"] = Estimate(float(fit.nuisance_of(k)[0]), data.unit)
    if data.drifts:
        drift, error = float(fit.nuisance_of(k)[1]), float(fit.nuisance_errors_of(k)[1])
        found[f"{data.quantity}_drift"] = Estimate(drift, f"{data.unit}/s", error)
    return found


def displacement_quantities(own: DisplacementFit, amounts: Array, per_volt: float) -> Estimates:
    """Return the quantities derived from one displacement; ``amounts`` are its linear terms in the joint fit."""
    return {
        "rest_position": Estimate(own.rest, "m"),
        "displacement_per_volt": _static(own, per_volt),
        "displacement_window": Estimate(own.data.window, "s"),
        "displacement_drift": _drift(own, amounts),
    }


def _static(own: DisplacementFit, per_volt: float) -> Estimate:
    """Return the static displacement, of laws that relax with its error: it is known where single gains cancel."""
    law = own.motion.law
    if law.kind is None:
        return Estimate(per_volt, "m/V")
    names = [p.name for p in law.parameters]
    signs = np.zeros(len(names))
    signs[list(law.gains)] = [-1.0 if names[k] in law.negative else 1.0 for k in law.gains]
    total = float(signs @ own.fit.values)
    error = float(np.sqrt(signs @ reported_covariance(own.fit) @ signs)) * abs(per_volt / total)
    half = float(student(0.975, reported_freedom(own.fit).min())) * error
    return Estimate(per_volt, "m/V", error, (per_volt - half, per_volt + half))


def _drift(own: DisplacementFit, amounts: Array) -> Estimate:
    if own.data.drift:
        return Estimate(float(amounts[1]), "m/s", float(own.fit.nuisance_errors[1]))
    if own.at_rest.bounds_drift:
        return Estimate(own.data.held, "m/s", fixed_because="held at the end of the interval at rest")
    rest, over = own.at_rest, format_quantity(own.data.window, "s", 4)
    known = f"a rest of {format_quantity(rest.length, 's', 3)} does not determine a drift over {over}"
    why = known if rest.count else "no readings at rest before the onset determine a drift"
    return Estimate(0.0, "m/s", fixed_because=f"left out: {why}")


def correlations(fit: FitResult) -> dict[str, float]:
    """Return the correlation of every pair of values, by their labels."""
    labels, matrix = fit.labels, fit.correlations
    parts = [set(part.labels) for part in fit.parts]
    return {
        f"{labels[b]}, {labels[a]}": float(matrix[b, a])
        for a in range(len(labels))
        for b in range(a)
        if any({labels[a], labels[b]} <= part for part in parts)
    }
