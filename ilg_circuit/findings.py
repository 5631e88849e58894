"""Findings: what a result or a file should be known for, as data; one sentence a code, made where it is shown.

Decisions ask for codes and numbers, never for words.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from string import Formatter
from typing import Any

from .units import format_quantity


@dataclass(frozen=True)
class Finding:
    """One finding: its ``code`` (a key of `SENTENCES`), its ``subject`` (a file, a quantity; may be empty), numbers.

    ``values`` fill the sentence's fields. ``str(finding)`` is the sentence, after its subject.
    """

    code: str
    subject: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        sentence = _FORMATTER.vformat(SENTENCES[self.code], (), self.values)
        return f"{self.subject}: {sentence}" if self.subject else sentence

    def about(self, subject: str) -> Finding:
        """The same of ``subject``, before what it is about already."""
        return Finding(self.code, f"{subject}: {self.subject}" if self.subject else subject, self.values)

    def to_dict(self) -> dict[str, Any]:
        """Code, subject, numbers and sentence, ready for JSON."""
        return {"code": self.code, "subject": self.subject, "values": dict(self.values), "text": str(self)}


def sentences(findings: Iterable[Finding]) -> tuple[str, ...]:
    """The sentences of ``findings``, each once."""
    return tuple(dict.fromkeys(map(str, findings)))


class Warned:
    """Mixin of results that have ``findings``: their sentences as warnings."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as sentences."""
        found: Iterable[Finding] = getattr(self, "findings", ())
        return sentences(found)


def codes(findings: Iterable[Finding]) -> set[str]:
    """The codes of ``findings``."""
    return {finding.code for finding in findings}


class _Formatter(Formatter):
    """Formats as `str.format`; ``{x:@V3}`` is a quantity in volt with three digits, ``{n:#point}`` a count of points.

    Lists are written with commas.
    """

    def format_field(self, value: Any, format_spec: str) -> Any:
        if format_spec.startswith("@"):
            return format_quantity(float(value), format_spec[1:-1], int(format_spec[-1]))
        if format_spec.startswith("#"):
            return f"{value} {format_spec[1:]}{'s' * (value != 1)}"
        if not format_spec and isinstance(value, list | tuple):
            return ", ".join(map(str, value))
        return super().format_field(value, format_spec)


_FORMATTER = _Formatter()

#: code -> sentence; fields are names in ``values``.
SENTENCES: dict[str, str] = {
    # -- identification: the port --
    "one-pole-not-enough": (
        "one pole is not enough: the residuals ({share:.1%} rms of the peak current) are autocorrelated; try "
        "--model rc2"
    ),
    "residuals-structured": (
        "model {model} does not describe all of the current: its residuals ({share:.1%} rms of the peak) are "
        "autocorrelated"
    ),
    "residuals-autocorrelated": "residuals are autocorrelated; standard errors are from a block bootstrap",
    "spectrum-misfit": (
        "the residuals of model {model} are {share:.2%} rms of abs(Z), the spectrum's own noise is {noise:.2%}: the "
        "model does not describe all of it"
    ),
    "resolution-coarse": (
        "the current's resolution of {step:@A2} is coarser than the residuals: what lies below it, such as the steady "
        "current, is not known as well as the standard errors say"
    ),
    "electron-path-open": "dc_resistance: {reason}; the strip is given {given:.3g} ohm",
    "electrode-resistance-not-determined": (
        "the electrode resistance is not determined by these data ({reason}): it is held at zero"
    ),
    "not-determined": "not determined by these data ({reason})",
    "model-not-fitted": "model {model} {reason}",
    "no-model-determined": "no model is fully determined by these data: the simplest that could be fitted is given",
    "start-not-confirmed": (
        "the best of {starts} fits was not reached from a second start: it may not be the global minimum"
    ),
    "file-not-described": "no port describes {files} even by itself: look at the file, or leave it out",
    "files-inconsistent": (
        "one port does not hold for all files: the individual fits are {ratio:g} times better or more for {files}"
    ),
    "file-outlying": (
        "without {file} one port holds for all others: is it of another strip, or of another state of it?"
    ),
    "kramers-kronig-points": (
        "{count} of {of} points break the Kramers-Kronig relations (by up to {worst:.1%} of abs(Z)): {frequencies}; "
        "they are left out of the fit"
    ),
    "kramers-kronig-residuals": (
        "Kramers-Kronig residuals are {rms:.1%} rms of abs(Z){structure}, largest at {at:@Hz4}: the strip drifted or "
        "answered nonlinearly while it was measured, or the readings are noisy; no circuit can fit better"
    ),
    # -- identification: the coupling --
    "displacement-not-fitted": "no displacement fit: {reason}",
    "displacements-inconsistent": "the displacements could not be fitted together ({reason})",
    "displacement-opposed": (
        "its displacement moves against the others': was the camera's axis or the strip's polarity reversed? it was "
        "left out of the coupling"
    ),
    "displacement-shortened": (
        "displacement fitted over the first {window:.4g} s only: later it drifts up to {away:@m3} away from the model"
    ),
    "displacement-not-described": (
        "d(s) does not describe the displacement: its residuals are more than noise at any length"
    ),
    "displacement-axis-reversed": (
        "the displacement falls as the voltage rises: its axis was taken to point away from the anode"
    ),
    "displacement-drifts": "the displacement drifts by {rate:@m3} a second: fitted as a straight line beside d(s)",
    "displacement-shows-inertia": (
        "the displacement shows the beam's inertia: E, density and damping are the actuator's"
    ),
    "displacement-autocorrelated": (
        "residuals of the displacement are autocorrelated; standard errors are from a block bootstrap"
    ),
    "no-actuator": (
        "no --actuator given: geometry and Young's modulus are the paper's; resistances and capacitances do not depend "
        "on them"
    ),
    "no-actuator-coupling": (
        "no --actuator given: geometry and Young's modulus are the paper's; resistances and capacitances do not depend "
        "on them, the coupling gain is in proportion to b^2/L_F^2"
    ),
    "coupling-not-fitted": "the coupling was not fitted: it is that of the given actuator",
    # -- intervals --
    "profile-failed": "no profile of {parameter} ({reason}); its interval is from a block bootstrap",
    "profile-open": "the data set {parameter} no {sides} limit within a factor of {reach:.0e}",
    "chain-short": "the Markov chain is short ({chain}); its intervals are rough",
    # -- hyperelastic --
    "terms-act-alike": "two of its terms act alike, or one does not act at all",
    "modulus-not-determined": "mu_{term} is not even known to a factor of ten",
    "alpha-not-determined": "alpha_{term} is {alpha:.3g} with a standard error of {error:.2g}",
    "alpha-ran-away": "alpha_{term} ran away to {alpha:.3g}",
    "material-not-determined": "{reason}; take a simpler model",
    "one-load-tested": (
        "fitted to the {test} test alone, which does not tell how the material answers other loads: at stretch "
        "{stretch:.3g} it predicts {predicted:@Pa4} {shown} ({test}: {there:@Pa4}); fit it jointly with --{shown}"
    ),
    "one-load-tested-absurd": (
        "fitted to the {test} test alone, which does not tell how the material answers other loads: at stretch "
        "{stretch:.3g} it predicts {predicted:@Pa4} {shown} ({test}: {there:@Pa4}); that is absurd, from stretch "
        "{since:.3g} on the equibiaxial stress is over {times:.0f} times the uniaxial: do not use it there; fit it "
        "jointly with --{shown}"
    ),
    "equibiaxial-absurd": (
        "no equibiaxial test was given: at stretch {stretch:.3g} it predicts {predicted:@Pa4} {shown} ({test}: "
        "{there:@Pa4}); that is absurd, from stretch {since:.3g} on the equibiaxial stress is over {times:.0f} times "
        "the uniaxial: do not use it there; fit it jointly with --{shown}"
    ),
    "planar-sign": (
        "a planar test cannot tell alpha from -alpha: with all signs turned the fit is the same, but the equibiaxial "
        "stress at stretch {stretch:.3g} is {stress:@Pa4}"
    ),
    "drucker-fails": (
        "Drucker's condition fails between stretch {low:.3g} and {high:.3g}, where no simulation will converge"
    ),
    "stress-falls": (
        "the nominal stress does not rise with the stretch (dP/dl <= 0) between {low:.3g} and {high:.3g}, where a "
        "dead load runs away"
    ),
    "shear-modulus-negative": "the shear modulus is {modulus:@Pa4}: no material has that",
    "modulus-extrapolated": (
        "extrapolation: the nearest reading to stretch 1 is {distance:.2g} away, so E and G, the slopes at 1, are "
        "extrapolated; measure smaller stretches"
    ),
    "modulus-differs": (
        "E is {fitted:@Pa4} by the fit, {small:@Pa4} by the readings below {strain:.0%} strain alone: take the latter "
        "for a strip that strains little{advice}"
    ),
    "stress-autocorrelated": (
        "the {test} residuals are not noise (neighbours correlate by {correlation:.2f}): the model misses part of the "
        "curve, and standard errors are too small"
    ),
    "prediction-extrapolated": "extrapolation: no {test} reading reaches stretch {stretches}",
    # -- measurements --
    "voltage-column": "voltage is the column {column}",
    "columns-ignored": "columns not understood and left out: {columns}",
    "overloaded": "{count:#reading} marked by the instrument as overloaded: current left out",
    "readings-at-one-time": "{count:#reading} at the same time as the next one: left out",
    "voltage-noise-averaged": "noise on the voltage ({noise:@V2} rms about its levels) was averaged out",
    "current-clipped": "current is clipped at {level:@A4}: {count:#sample} at the instrument's limit left out",
    "current-rises": "the current drifts: it rises again by {rise:@A3} from {since:@s3} on, which no model here does",
    "current-not-settled": (
        "the current has not settled: over the last third it falls by {fall:@A3}, no slower than before"
    ),
    "rows-blank": "{count} of {total} rows have no {quantity} (drop-outs): left out",
    "readings-apart": (
        "{count:#reading} of {reading:@{unit}5} far from all others of the {quantity} (drop-outs): left out"
    ),
    "rest-drifts": "the {quantity} drifts by {drift:@{unit}3} while at rest, before the onset",
    "displacement-too-short": "fewer than {needed} displacement samples after the onset: no displacement fit",
    "points-blank": "{count:#point} without a number: left out",
    "points-without-frequency": ("{count:#point} whose frequency is not positive (or beyond all measure): left out"),
    "points-dropped-out": "{count:#point} with no sensible reading (a drop-out): left out",
    "points-repeated": "{count:#point} at a frequency that was there before (the first reading is kept): left out",
    "points-inductive": (
        "{count:#point} from {least:@Hz4} on, where Im Z is positive (the leads' inductance): left out"
    ),
    "points-active": "{count:#point} with Re Z below zero, which no passive strip has",
    # -- study --
    "assumption-fails": "{text}",
    "designs-failed": "{failures} of the first {total} designs within the ranges could not be judged",
    # -- cpg: causes of an outcome --
    "cpg-rests": "comes to rest with active neurons: {active} (decay {decay:.3g} 1/s)",
    "cpg-rests-on-edge": "comes to rest with active neurons: {active} (on the edge of its piece)",
    "cpg-silent": "comes to rest with active neurons: {active} (silent)",
    "cpg-died-out": "has no input, and what it started with has died out",
    "cpg-cycle": "repeats itself; of a disturbance {multiplier:.3g} is left after a period",
    "cpg-edge": "on the edge of stability: no mode grows or dies out there",
    "cpg-stiff": "could be followed for {time:.3g} s only: the time constants lie too far apart",
    "cpg-irregular": "neither at rest nor periodic within {time:.4g} s{rest}",
    # -- cpg --
    "cpg-unstable-cycle": "neurons {groups} start alike and receive alike, so they stay alike, but this cycle is "
    "unstable (multiplier {multiplier:.3g}): start them unlike",
    "cpg-unstable-rest": "neurons {groups} start alike and receive alike, so they stay alike, but this rest is "
    "unstable (growing by {rate:.3g} 1/s): start them unlike",
    "cpg-family": "the cycle is one of a family: a disturbance neither grows nor dies out",
    "cpg-no-period": "the duration {duration:.4g} s is too short to show one period, {period:.4g} s; period and "
    "amplitude are those of the cycle that is reached later",
    "cpg-unsettled-cycle": "the duration {duration:.4g} s ends before the motion has settled; period and amplitude are "
    "those of the cycle that is reached after about {settled:.3g} s",
    "cpg-unsettled-rest": "the duration {duration:.4g} s ends before the motion has settled; it comes to rest later",
    # -- arm --
    "arm-still": "the network does not oscillate: the arm comes to rest",
    "arm-circuit-lag": "the circuit keeps {kept:.2%} of the ideal amplitude at the rhythm's {period:.4g} s (below "
    "{least:.0%}): the motion is the circuit's lag, not the rhythm's",
    "arm-crosses-itself": "the arm crosses itself at segment {segment}; self-contact is not modelled",
    "arm-touches-plane": "segment {segment} touches the plane",
    "arm-method": "{method} method: {reason}",
    "arm-step-error": "error of a step at most {tolerance:g} of {scale:.3g} m",
    "arm-steps": "{steps} steps of {shortest:.3g} to {longest:.3g} s, {refused} refused",
    "arm-recorded": "{text}",
    # -- arm: reasons why not every position can be reached --
    "reach-too-far": "the target is {away:@m4} from the base, the arm {length:@m4} long",
    "reach-one-unit": "one unit drives all segments alike: its shapes are a family of one parameter, and but for "
    "inertia the tip stays on one curve",
    "reach-one-rhythm": "the units of a chain repeat one rhythm one after another: amplitude, period and lag are all "
    "there is to choose",
    "reach-bounded-strain": "the voltage is bounded, so the free strain is: {strain:.3g} turns the tip by "
    "{turn:.3g} degrees at rest and moves it by {moved:@m4}",
    "reach-circuit": "the strips' circuits keep {kept:.2%} of the ideal amplitude at this motion's {period:.4g} s",
}
