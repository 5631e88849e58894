"""The resistance along a strip's electrodes, from impedance spectra of one length of it or of several.

Where abs(gamma L) is small, Zin is 1/(y L) + r L/3: the sheets act as a resistance in series, which most models of the
strip have anyway. Then a second length tells them apart, since r L grows with it and 1/(y L) falls. Beyond abs(gamma L)
of about one the frequency does, for a given model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from ..arrays import ComplexArray, plain
from ..errors import InputError, SolveError, argument
from ..findings import Finding, Warned, by_importance
from ..fit.estimate import Estimate, Estimated
from ..fit.identifiability import DETERMINED
from ..fit.intervals import uncertainties
from ..fit.limits import limits
from ..fit.reported import reported_errors
from ..fit.result import FitResult
from ..measurements.spectrum import Spectrum
from ..result import Column, Result
from ..strip.models import candidates, electrical_model
from .impedance import ImpedanceData
from .port_findings import spectrum_findings
from .port_model import DC, ELECTRODE_RESISTANCE
from .sheets_model import SHEETS, Contact, Fitted, Line, SheetsModel, fit_sheets

#: Relative standard error above which intervals are profiles.
_CURVED = 0.1
#: Ratio of the ends of its interval up to which the sheets' resistance is told from others. Where the sheets hardly
#: show, noise makes them seem larger and sharper together, so that an interval above zero is not enough.
_SEPARATED = 2.0
#: Sine of the angle between its effect and those of all others above which noise alone hides it.
_APART = 0.05
#: abs(gamma L) below which the sheets act as a resistor in series, and above which terminals see r/y alone.
_SERIES, _LONG = 1.0, 3.0
#: Factor of frequencies beyond the measured ones in which abs(gamma L) is followed.
_BEYOND = 1e4

#: Factor of the error from which a longer strip is asked for, not a piece of it.
_MUCH = 10.0

Separable = Literal["yes", "yes: in the noise", "no: too short", "no: too long", "no"]


@dataclass(frozen=True, repr=False, eq=False)
class SheetsFit(Warned, Estimated, Result):
    """The resistance along a strip from its spectra, as `ilg_circuit.identify_sheets` returns it.

    Attributes
    ----------
    fit : FitResult
        The fit; ``sheets_fit["sheet_resistance"]`` is an estimate with its unit.
    model : str
        Electrical model of the strip between the sheets.
    contact : {"end", "both"}
        Where the strip is contacted.
    lengths : tuple of float
        Length of the strip of each spectrum [m], without what lies under the contacts.
    length : float
        Length [m] of the strip whose port the other parameters are, without sheets.
    width : float
        Its width [m].
    data : tuple of ImpedanceData
        The spectra.
    parameters : mapping of str to Estimate
        The sheets' resistance and the port's parameters.
    gamma_length : float
        Largest abs(gamma L) of all spectra, L from a contact to the end of its line.
    separable : bool
        True if the data tell the sheets' resistance from the strip's own, for this model.
    warnings : tuple of str
        Findings as sentences: why it is not, and what would tell.
    """

    presenter: ClassVar[str] = "sheets_fit"

    fit: FitResult
    model: str
    contact: str
    lengths: tuple[float, ...]
    length: float
    width: float
    data: tuple[ImpedanceData, ...]
    parameters: Mapping[str, Estimate]
    gamma_length: float
    separable: bool
    findings: tuple[Finding, ...] = ()

    def estimate_tables(self) -> Mapping[str, Mapping[str, Estimate]]:
        """Return the parameters, and the sheets' resistance for a length."""
        sheets = self.parameters[SHEETS.name]
        return {"parameter": self.parameters, "derived": {"resistance_per_length": _over(sheets, self.width)}}

    def table(self) -> tuple[Column, ...]:
        """Return one row per estimate."""
        return Estimated.table(self)

    def fitted(self, k: int) -> ComplexArray:
        """Return the fitted impedance [ohm] at the frequencies of spectrum ``k``."""
        return self.data[k].shown(self.fit.fitted(k))

    def to_dict(self) -> dict[str, Any]:
        """Return estimates, the verdict, and the spectra with their fit as plain data."""
        tables = self.estimate_tables()
        return {
            "model": self.model,
            "contact": self.contact,
            "length_m": self.length,
            "width_m": self.width,
            "parameters": {name: e.to_dict() for name, e in tables["parameter"].items()},
            "derived": {name: e.to_dict() for name, e in tables["derived"].items()},
            "largest_gamma_length": self.gamma_length,
            "separable": self.separable,
            "spectra": [
                {
                    "source": d.source,
                    "length_m": length,
                    "relative_rms": d.relative_rms(self.fit.residuals_of(k)),
                    "frequency_Hz": plain(d.abscissa),
                    "re_ohm": plain(d.spectrum.impedance.real),
                    "im_ohm": plain(d.spectrum.impedance.imag),
                    "fitted_re_ohm": plain(self.fitted(k).real),
                    "fitted_im_ohm": plain(self.fitted(k).imag),
                }
                for k, (d, length) in enumerate(zip(self.data, self.lengths, strict=True))
            ],
            "findings": [finding.to_dict() for finding in self.findings],
            "warnings": list(self.warnings),
        }


def identify_sheets(
    spectra: Sequence[Spectrum],
    lengths: Sequence[float],
    width: float,
    *,
    length: float | None = None,
    model: str = "auto",
    contact: Contact = "end",
    contact_length: float = 0.0,
    electrode_resistance: float | None = 0.0,
) -> SheetsFit:
    """Return the fit of spectra of ``lengths`` [m] of one strip; ``electrode_resistance`` [ohm] None is fitted.

    ``length`` [m] is that of the strip whose port the parameters are (None: the first one). Raises InputError for
    spectra or a model that do not fit, SolveError where no fit converges.
    """
    if len(lengths) != len(spectra):
        raise InputError(
            f"{argument('lengths')}: {len(lengths)} for {len(spectra)} spectra; give the length of each of them"
        )
    reference = lengths[0] if length is None else length
    lines = tuple(Line(each, width, reference, contact, contact_length) for each in lengths)
    data = tuple(ImpedanceData.of(spectrum) for spectrum in spectra)
    for d in data:
        d.require_electrode_resistance(electrode_resistance or 0.0)
    found = _chosen(model, data, lines, electrode_resistance)
    parameters = _estimates(found)
    verdict = _verdict(found, parameters[SHEETS.name])
    findings = [note.about(d.source) if len(data) > 1 else note for d in data for note in d.notes]
    findings += _on_sheets(found, parameters[SHEETS.name], verdict)
    loose = [name for name, e in parameters.items() if e.interval and e.reported[0] > DETERMINED * e.value]
    if loose := [name for name in loose if name != SHEETS.name]:
        reason = f"standard error over {DETERMINED:.0%}: {', '.join(loose)}"
        findings.append(Finding("not-determined", values={"reason": reason}))
    for k, d in enumerate(data):
        findings += spectrum_findings(d, found.fit.residuals_of(k), found.model.kind.name)
    return SheetsFit(
        fit=found.fit,
        model=found.model.kind.name,
        contact=contact,
        lengths=tuple(lengths),
        length=reference,
        width=width,
        data=data,
        parameters=parameters,
        gamma_length=0.0 if found.bare else float(found.gamma_length().max()),
        separable=verdict.startswith("yes"),
        findings=tuple(by_importance(findings)),
    )


def _chosen(model: str, data: tuple[ImpedanceData, ...], lines: tuple[Line, ...], held: float | None) -> Fitted:
    """Return the fit by a model, or of "auto" the one of least BIC."""
    if model != "auto":
        kind = electrical_model(model)
        if not kind.linear or kind.needs_several_voltages:
            raise InputError(
                f"model {kind.name} is nonlinear: small signals about 0 V do not show all of it; "
                f"give a linear model, such as {argument('model', kind.plain)}"
            )
        return fit_sheets(SheetsModel(kind, held), data, lines)
    found: list[Fitted] = []
    failure: InputError | SolveError | None = None
    for name in candidates("spectrum"):
        try:
            found.append(fit_sheets(SheetsModel(electrical_model(name), held), data, lines))
        except (InputError, SolveError) as error:  # too few points for this one, or no minimum
            failure = failure or error
    if not found:
        assert failure is not None
        raise failure

    def criterion(each: Fitted) -> float:  # with what was held for having no effect: a simpler model does the same
        return each.fit.bic + float(np.log(len(each.fit.residuals))) * len(each.fixed)

    return min(found, key=criterion)


def _estimates(found: Fitted) -> dict[str, Estimate]:
    """Return the parameters in the order of the model's names, the sheets first.

    Intervals of what is determined well are those of any fit, else profiles: the misfit is then no parabola. All are
    profiles where the sheets' resistance is not known well, since others are exchanged with it.
    """
    fit = found.fit
    at = fit.labels.index(SHEETS.name)
    known = bool(np.isfinite(fit.errors).all()) and not found.bare
    errors = reported_errors(fit) if known else fit.errors
    sharp = known & (errors < _CURVED * fit.values)
    sharp &= sharp[at]
    wider = errors / fit.pooled_errors if known else np.ones(len(errors))
    estimates = uncertainties(fit).estimates if sharp.any() else {}
    for k, label in enumerate(fit.labels):
        if not sharp[k]:
            estimates[label] = _profiled(fit, k, float(wider[k]), bare=found.bare and label == SHEETS.name)
    units = {p.name: p.unit for p in found.model.parameters}
    held = {
        label: Estimate(fit.problem.fixed[label], units[label], fixed_because=why) for label, why in found.fixed.items()
    }
    every = estimates | held
    order = [SHEETS.name, *(name for name in found.model.names if name != SHEETS.name)]
    if found.model.held:
        order.append(ELECTRODE_RESISTANCE.name)
        every[ELECTRODE_RESISTANCE.name] = Estimate(found.model.held, "ohm", fixed_because="held")
    return {name: every[name] for name in order}


def _profiled(fit: FitResult, k: int, widening: float, *, bare: bool) -> Estimate:
    """Return the estimate of value ``k`` with an interval by its profile, whose open ends are 0 and infinite."""
    ends = limits(fit, k, widening)
    low, high = ends.low, ends.high
    unit, value = fit.problem.moved[k].unit, float(fit.values[k])
    if bare:
        low, value = 0.0, 0.0
    error = float(fit.errors[k])
    wide = (high - low) / 3.92  # an interval of 95 % is that many standard errors wide
    error = min(wide, error if np.isfinite(error) else wide)
    if not np.isfinite(error):
        error = value
    return Estimate(value, unit, error, (low, high), ci95_profile=(low, high), method="profile")


def _over(e: Estimate, width: float) -> Estimate:
    """Return an estimate per square as one for a length [ohm/m]."""

    def scaled(ends: tuple[float, float] | None) -> tuple[float, float] | None:
        return None if ends is None else (ends[0] / width, ends[1] / width)

    def one(x: float | None) -> float | None:
        return None if x is None else x / width

    return replace(
        e,
        value=e.value / width,
        unit="ohm/m",
        stderr=one(e.stderr),
        ci95=scaled(e.ci95),
        bootstrap=one(e.bootstrap),
        ci95_bootstrap=scaled(e.ci95_bootstrap),
        ci95_profile=scaled(e.ci95_profile),
        autoregression=one(e.autoregression),
        ci95_autoregression=scaled(e.ci95_autoregression),
    )


def _verdict(found: Fitted, sheets: Estimate) -> Separable:
    """Return whether the data tell the sheets' resistance from the strip's own, and why not."""
    interval = sheets.interval
    assert interval is not None
    low, high = interval
    if low > 0 and high <= _SEPARATED * low:
        return "yes"
    if found.apart > _APART:
        return "yes: in the noise"
    if found.bare or found.gamma_length().max() < _SERIES:
        return "no: too short"
    return "no: too long" if found.gamma_length().min() > _LONG else "no"


def _on_sheets(found: Fitted, sheets: Estimate, verdict: Separable) -> list[Finding]:
    """Return findings on what the data cannot separate, and what would."""
    gamma = found.gamma_length()
    lengths = [line.length for line in found.lines]
    model = found.model.kind.name
    result = []
    if DC in found.fixed:
        given = float(found.fit.problem.fixed[DC])
        result.append(Finding("electron-path-open", values={"reason": found.fixed[DC], "given": given}))
    if verdict == "yes":
        if len(set(lengths)) == 1:
            result.append(Finding("sheets-by-model", values={"model": model}))
        return result
    low, high = sheets.interval or (0.0, np.inf)
    parts = [f"at least {low:.3g}"] if low else []
    parts += [f"at most {high:.3g}"] if np.isfinite(high) else []
    bounds = " and ".join(parts) or "of any size"
    if verdict == "yes: in the noise":
        return [*result, Finding("sheets-in-the-noise", values={"bounds": bounds})]
    reach = float(found.gamma_length(high).max()) if np.isfinite(high) else float(gamma.max())
    code = {"no: too short": "sheets-in-series", "no: too long": "sheets-too-long"}.get(verdict, "sheets-not-separable")
    values = {"bounds": bounds, "most": reach, "least": float(gamma.min()), "model": model}
    result.append(Finding(code, values=values))
    half, twice = min(lengths) / 2, 2 * max(lengths)
    advised = half if found.expected(half) < _MUCH * found.expected(twice) else twice
    if np.isfinite(error := found.expected(advised)):
        result.append(Finding("sheets-other-length", values={"length": advised, "error": 1.96 * error}))
    if verdict == "no: too short":
        result.append(_higher(found, sheets.value or high))
    return result


def _higher(found: Fitted, sheets: float) -> Finding:
    """Return the finding on the frequency at which abs(gamma L) would be one, for ``sheets`` [ohm per square]."""
    longest = int(np.argmax([line.length for line in found.lines]))
    top = float(max(d.abscissa[-1] for d in found.data))
    f = np.geomspace(top, _BEYOND * top, 200)
    s: ComplexArray = np.asarray(2j * np.pi * f)
    gamma = found.gamma(found.lines[longest], s, sheets if np.isfinite(sheets) else None)
    beyond = np.flatnonzero(gamma >= 1)
    if len(beyond):
        return Finding("sheets-higher-frequency", values={"frequency": float(f[beyond[0]])})
    most = max(float(gamma.max()), float(found.gamma_length(sheets if np.isfinite(sheets) else None).max()))
    needed = found.lines[longest].length / most
    return Finding("sheets-no-frequency", values={"length": needed})
