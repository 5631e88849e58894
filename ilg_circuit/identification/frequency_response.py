"""Identifies the frequency response of a strip from records of sines, sweeps or noise, and compares it with a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, ComplexArray, Mask, one_thread, plain
from ..errors import InputError, argument
from ..findings import Finding, Warned
from ..fit.quantiles import fisher
from ..measurements.waves import ANSWERS, Waves
from ..result import Column, Result
from ..simulation.bode import QUANTITIES, Bode, half_power
from ..units import format_quantity
from .excitation import Sweep, excitation
from .spectral import CYCLES, CYCLES_FROM_REST, MISSING, Lines, drift_of, joined, periods, polynomials
from .wave_faults import BRIDGED, gaps, longest_stretch, not_swept, sound

#: Frequencies per decade of a sweep, fewest samples a cycle, and unevenness of steps that is none.
_A_DECADE, _SAMPLES, _EVEN = 10, 5, 0.01
#: Part of the span within which the first voltage is at its middle: such a record is taken to begin at rest.
_AT_MIDDLE = 0.05
#: Part of the span of a voltage below which its middle is noise.
_CENTRED = 2e-3
#: Fewest readings under a constant voltage that show a rest, and most whose mean it is.
_AT_REST, _REST = 3, 100
#: Part of the voltage's span within which the strip has hardly moved.
_NEAR = 0.02
#: Probability of the 95 % band, and of a finding on a model that is outside where it should not be.
_BAND, _CHANCE = 0.95, 0.01


@dataclass(frozen=True, repr=False, eq=False)
class BodeOfRecords(Warned, Result):
    """The measured frequency response of a strip, as `ilg_circuit.bode_of` returns it.

    Attributes
    ----------
    frequency : ndarray (f,)
        Frequencies [Hz] of all records, ascending.
    responses : dict of str to ndarray (f,), complex
        Displacement [m/V], current [A/V] and force [N/V], as measured; NaN where a record has no such column.
    variance : dict of str to ndarray (f,)
        Variance of the complex error of each response, in its unit squared.
    coherence : dict of str to ndarray (f,)
        Part of the power of each answer, from 0 to 1, that follows the voltage.
    freedom : ndarray (f,)
        Degrees of freedom of the variance: independent periods or lines, less what was fitted.
    source : tuple of str
        Record of each frequency.
    excited : dict of str to str
        How each record was excited: "sines", "steps of sines", "sweep" or "noise".
    bias : float
        Voltage about which the strip was moved, the mean of all records [V].
    model : Bode or None
        The same of a strip, at these frequencies.
    curve : Bode or None
        The same over the whole band, to be drawn.
    warnings : tuple of str
        Findings as sentences, such as frequencies at which the model lies outside the band.
    """

    presenter: ClassVar[str] = "bode_of_records"

    frequency: Array
    responses: dict[str, ComplexArray]
    variance: dict[str, Array]
    coherence: dict[str, Array]
    freedom: Array
    source: tuple[str, ...]
    excited: dict[str, str]
    bias: float
    model: Bode | None = None
    curve: Bode | None = None
    findings: tuple[Finding, ...] = ()

    def response(self, name: str) -> ComplexArray:
        """Return the response (f,) of "displacement", "current" or "force"."""
        return self.responses[name]

    def magnitude(self, name: str) -> Array:
        """Return the magnitude (f,) of a response."""
        return np.abs(self.responses[name])

    def phase(self, name: str) -> Array:
        """Return the phase (f,) of a response [deg], without jumps of a whole turn where it is known."""
        values = np.degrees(np.angle(self.responses[name]))
        known = np.isfinite(values)
        values[known] = np.unwrap(values[known], period=360.0)
        return values

    def radius(self, name: str) -> Array:
        """Return the radius (f,) of the circle about each response that holds the true one with 95 % probability."""
        return np.sqrt(fisher(_BAND, 2, 2 * self.freedom) * self.variance[name])

    def band(self, name: str) -> tuple[Array, Array]:
        """Return half the widths (f,) of the 95 % bands of a magnitude [its unit] and of a phase [deg]."""
        radius = self.radius(name)
        with np.errstate(divide="ignore", invalid="ignore"):
            angle = np.degrees(np.arcsin(np.minimum(radius / self.magnitude(name), 1.0)))
        return radius, np.where(radius >= self.magnitude(name), 180.0, angle)

    def outside(self, name: str) -> Mask:
        """Return where (f,) the model lies outside the 95 % band; nowhere without a model."""
        if self.model is None:
            return np.zeros(len(self.frequency), dtype=bool)
        found: Mask = np.abs(self.model.response(name) - self.responses[name]) > self.radius(name)
        return found

    @property
    def bandwidth(self) -> float | None:
        """Frequency [Hz] from which on the displacement is below 0.707 of that at the lowest one.

        None if it never is, or if readings are missing where one of the two frequencies was swept.
        """
        if "displacement" not in self.responses:
            return None
        known = np.isfinite(self.magnitude("displacement"))
        found = half_power(self.frequency[known], self.magnitude("displacement")[known])
        missed = [(note.values["low"], note.values["high"]) for note in self.findings if note.code == "sweep-gap"]
        lost = any(low < self.frequency[0] or (found is not None and low <= found <= high) for low, high in missed)
        return None if lost else found

    def table(self) -> tuple[Column, ...]:
        """Return frequency [Hz], and magnitude, phase [deg], their 95 % bands and the coherence of each answer (f,)."""
        columns = [Column("frequency", self.frequency, "Hz", over=True)]
        for name in self.responses:
            unit = QUANTITIES[name][0]
            size, angle = self.band(name)
            columns += [
                Column(name, self.magnitude(name), unit),
                Column(f"{name}_phase", self.phase(name), "deg"),
                Column(f"{name}_band", size, unit),
                Column(f"{name}_phase_band", angle, "deg"),
                Column(f"{name}_coherence", self.coherence[name], ""),
            ]
            if self.model is not None:
                columns.append(Column(f"{name}_model", self.model.magnitude(name), unit))
                columns.append(Column(f"{name}_model_outside", self.outside(name).astype(float), ""))
        return (*columns, Column("freedom", self.freedom, ""))

    def to_dict(self) -> dict[str, Any]:
        """Return the response as plain data, lists by header."""
        return {
            "actuator": None if self.model is None else self.model.actuator.name,
            "records": self.excited,
            "bias_V": self.bias,
            "bode": {header: plain(np.asarray(values)) for header, values in self.columns().items()},
            "source": list(self.source),
            "bandwidth_Hz": self.bandwidth,
            "findings": [finding.to_dict() for finding in self.findings],
            "warnings": list(self.warnings),
        }


@one_thread()
def bode_of_records(
    records: Sequence[Waves], low: float | None = None, high: float | None = None, skip: float | None = None
) -> BodeOfRecords:
    """Return the response that ``records`` show, between ``low`` and ``high`` [Hz] where these are given.

    The first ``skip`` [s] of sines are left out (default: periods that differ from the later ones by more than their
    scatter). Raises InputError for a record without excitation or displacement, or one that is too short.
    """
    parts, findings = [], []
    for record in records:
        _require_motion(record)
        waves, faults = sound(record)
        lines, how, more = _of_record(waves, low, high, skip)
        told = [*faults, *more]
        parts.append((waves, lines, how))
        findings += [note.about(waves.source) if len(records) > 1 else note for note in told]
    names = [name for name in ANSWERS if any(name in waves.answers for waves, _, _ in parts)]
    whole = joined([_with_all(waves, lines, names) for waves, lines, _ in parts])
    if not len(whole.frequency):
        raise InputError(
            f"no frequency between {argument('low')} and {argument('high')} is excited; leave these out for all of them"
        )
    every = np.concatenate([lines.frequency for _, lines, _ in parts])
    sources = [waves.source for waves, lines, _ in parts for _ in lines.frequency]
    order = np.argsort(every, kind="stable")
    by_name = {name: k for k, name in enumerate(names)}
    return BodeOfRecords(
        frequency=whole.frequency,
        responses={name: whole.response[k] for name, k in by_name.items()},
        variance={name: whole.variance[k] for name, k in by_name.items()},
        coherence={name: whole.coherence[k] for name, k in by_name.items()},
        freedom=whole.freedom,
        source=tuple(sources[k] for k in order),
        excited={waves.source: how for waves, _, how in parts},
        bias=float(np.mean([_middle(waves.voltage) for waves in records])),
        findings=tuple(findings),
    )


def compared(found: BodeOfRecords, model: Bode, curve: Bode) -> BodeOfRecords:
    """Return the response beside that of a ``model`` at its frequencies, and the model's ``curve``.

    A displacement that moves against the model's is turned: its axis points away from the anode.
    """
    findings = list(found.findings)
    responses: Mapping[str, ComplexArray] = found.responses
    if "displacement" in responses:
        measured = responses["displacement"]
        if float(np.nansum((measured * model.displacement.conj()).real)) < 0:
            responses = {**responses, "displacement": -measured}
            findings.append(Finding("displacement-axis-reversed"))
    beside = replace(found, responses=dict(responses), model=model, curve=curve)
    for name in responses:
        findings += _outside(beside, name)
    return replace(beside, findings=tuple(findings))


def _outside(found: BodeOfRecords, name: str) -> list[Finding]:
    """Return a finding on the frequencies at which the model is outside, if there are more than chance explains."""
    from scipy.stats import binom, f

    outside, known = found.outside(name), np.isfinite(found.magnitude(name))
    count = int(known.sum())
    assert found.model is not None
    away = np.abs(found.model.response(name) - found.responses[name])[known]
    with np.errstate(divide="ignore", invalid="ignore"):
        chances = f.sf(away**2 / found.variance[name][known], 2, 2 * found.freedom[known])
    many = int(outside.sum()) > binom.ppf(1 - _CHANCE, count, 1 - _BAND)
    if not (many or float(chances.min(initial=1.0)) * count < _CHANCE):
        return []
    shown = [format_quantity(x, "Hz", 3) for x in found.frequency[outside].tolist()]
    rest = len(shown) - 6
    values = {
        "quantity": name,
        "count": int(outside.sum()),
        "of": count,
        "chance": (1 - _BAND) * count,
        "frequencies": shown if rest <= 0 else [*shown[:6], f"{rest} more"],
    }
    return [Finding("model-outside-band", values=values)]


def _with_all(waves: Waves, lines: Lines, names: Sequence[str]) -> Lines:
    """Return the lines with a row for each of ``names``, NaN where the record has no such column."""
    rows = [list(waves.answers).index(name) if name in waves.answers else -1 for name in names]

    def filled(values: Any) -> Any:
        blank = np.full((1, values.shape[1]), np.nan, dtype=values.dtype)
        return np.vstack([values, blank])[rows]

    return replace(
        lines,
        response=filled(lines.response),
        variance=filled(lines.variance),
        coherence=filled(lines.coherence),
    )


def _require_motion(waves: Waves) -> None:
    if not waves.answers.keys() & {"displacement", "force"}:
        raise InputError(
            f"{waves.source}: the displacement is missing; give a record with a column such as displacement_mm or "
            "force_mN (a current alone is an impedance: fit it with identify)"
        )


def _of_record(
    waves: Waves, low: float | None, high: float | None, skip: float | None
) -> tuple[Lines, str, list[Finding]]:
    """Return the lines of one record, how it was excited, and findings."""
    excited = excitation(waves.time, waves.voltage, waves.source)
    if isinstance(excited, Sweep) and not excited.sweeps:
        waves, told = longest_stretch(waves)
        if told:
            lines, how, more = _of_record(waves, low, high, skip)
            return lines, how, [*told, *more]
    outputs = np.array(list(waves.answers.values()))
    if isinstance(excited, Sweep):
        return _swept(waves, outputs, excited, low, high)
    parts, findings = [], []
    for sines in excited:
        findings += [
            Finding("sines-gap", values={"from": a, "long": b - a})
            for a, b in gaps(waves.time[sines.part])
            if b - a > MISSING * sines.period
        ]
        try:
            lines, begin = periods(
                waves.time[sines.part],
                waves.voltage[sines.part],
                outputs[:, sines.part],
                sines.frequency,
                sines.period,
                skip,
            )
        except InputError as error:
            if len(excited) > 1:  # one step of several
                continue
            raise InputError(
                f"{waves.source}: holds {error}: measure longer, or leave out less at its beginning"
            ) from None
        start = float(waves.time[sines.part.start])
        if begin - start > sines.period and skip is None:
            findings.append(Finding("transient-left-out", values={"from": start, "to": begin}))
        parts.append(lines)
    if not parts:
        raise InputError(f"{waves.source}: no step has two whole periods of its sine; measure each of them longer")
    whole = joined(parts)
    inside = (whole.frequency >= (low or 0.0) * 0.999) & (whole.frequency <= (high or np.inf) * 1.001)
    return whole.at(inside), "sines" if len(excited) == 1 else "steps of sines", findings


def _swept(
    waves: Waves, outputs: Array, excited: Sweep, low: float | None, high: float | None
) -> tuple[Lines, str, list[Finding]]:
    """Return the lines of a sweep or of noise."""
    findings = []
    start, u = excited.start, waves.voltage[excited.start :]
    from_rest = start >= _AT_REST  # readings before the voltage moves
    if not from_rest and excited.sweeps and abs(u[0] - _middle(u)) < _AT_MIDDLE * float(np.ptp(u)):
        from_rest = True
        findings.append(Finding("response-from-rest"))
    t = waves.time[start:] - waves.time[start]
    step, duration = float(np.median(np.diff(t))), float(t[-1])
    cycles = CYCLES_FROM_REST if from_rest else CYCLES
    begins = excited.low if low is None else max(low, excited.low)
    if not excited.sweeps and low is None:  # noise has no lowest frequency
        begins = min(max(begins, cycles / duration), excited.high)
    ends = min(excited.high if high is None else min(high, excited.high), 1 / (_SAMPLES * step))
    if (there := duration * begins) < cycles:
        least = format_quantity(1.01 * cycles / duration, "Hz", 3).replace(" ", "")
        raise InputError(
            f"{waves.source}: the {'chirp' if excited.sweeps else 'record'} is too short for its lowest frequency: "
            f"{format_quantity(begins, 'Hz', 3)} has {there:.2g} cycles in {format_quantity(duration, 's', 4)}, and "
            f"{cycles} are needed; take {format_quantity(float(np.ceil(cycles / begins)), 's', 4)}, or begin higher: "
            f"{argument('low', least)}"
        )
    if ends < begins:
        raise InputError(
            f"{waves.source}: it excites {format_quantity(excited.low, 'Hz', 3)} to "
            f"{format_quantity(excited.high, 'Hz', 3)}, none of it within {argument('low')} and {argument('high')} or "
            f"below {_SAMPLES} samples a cycle ({format_quantity(1 / (_SAMPLES * step), 'Hz', 3)})"
        )
    count = max(round(_A_DECADE * np.log10(ends / begins)), 1) + 1
    # the last readings before the voltage leaves its rest, or as long as it is near it
    last = start + int(np.argmax(np.abs(u - u[0]) > _NEAR * float(np.ptp(u))))
    rests = slice(max(start - _REST, 0), start + 1 if start >= _AT_REST else last) if from_rest else slice(start, None)
    signals = np.vstack([waves.voltage, outputs])
    signals = signals[:, start:] - signals[:, rests].mean(axis=1)[:, None]
    frequency = np.geomspace(begins, ends, count)
    if excited.sweeps:
        lost, told = not_swept(t, u, excited.low, excited.high, frequency)
        findings += [
            replace(note, values={**note.values, "from": note.values["from"] + waves.time[start]}) for note in told
        ]
        frequency = frequency[~lost]
        if not len(frequency):
            raise InputError(f"{waves.source}: {'; '.join(map(str, findings))}: no frequency is left; measure again")
    if np.abs(np.diff(t) / step - 1).max() > _EVEN:
        signals = _evenly(t, signals, step)
    readings = rests.stop - rests.start if from_rest else 0
    even: Array = np.arange(signals.shape[1], dtype=np.float64) * step
    since = float((waves.time[rests].mean() if from_rest else waves.time[start:].mean()) - waves.time[start])
    drift = None
    if all(b - a < BRIDGED * step for a, b in gaps(t)):  # what is missing looks like a drift
        drift = drift_of(step, signals[0], signals[1:], frequency, readings, since)
        for name, rate, values in zip(waves.answers, drift.rate.tolist(), signals[1:], strict=True):
            if rate:
                share = abs(rate) * float(t[-1]) / float(np.ptp(values))
                findings.append(Finding("answer-drifts", values={"quantity": name, "rate": rate, "share": share}))
        signals[1:] -= drift.at(even)
    lines = polynomials(step, signals[0], signals[1:], frequency, readings, drift)
    return lines, "sweep" if excited.sweeps else "noise", findings


def _evenly(t: Array, signals: Array, step: float) -> Array:
    """Return ``signals`` (s, n) at even times, by cubic splines, and by straight lines where many are missing."""
    from scipy.interpolate import CubicSpline

    even = np.arange(0.0, t[-1], step)
    curves = CubicSpline(t, signals, axis=1)(even)
    for a, b in gaps(t):
        if b - a < BRIDGED * step:
            continue
        inside = (even > a) & (even < b)
        curves[:, inside] = [np.interp(even[inside], t, row) for row in signals]
    return np.asarray(curves)


def _middle(values: Array) -> float:
    """Return the middle of the range of a voltage, 0 where it is hardly off it."""
    middle = (float(values.max()) + float(values.min())) / 2
    return middle if abs(middle) > _CENTRED * float(np.ptp(values)) else 0.0
