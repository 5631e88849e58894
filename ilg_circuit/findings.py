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
    """Formats as `str.format`, and ``{x:@V3}`` as a quantity in volt with three digits; lists with commas."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        if format_spec.startswith("@"):
            return format_quantity(float(value), format_spec[1:-1], int(format_spec[-1]))
        if not format_spec and isinstance(value, list | tuple):
            return ", ".join(map(str, value))
        return super().format_field(value, format_spec)


_FORMATTER = _Formatter()

#: code -> sentence; fields are names in ``values``.
SENTENCES: dict[str, str] = {
    # -- intervals --
    "profile-failed": "no profile of {parameter} ({reason}); its interval is from a block bootstrap",
    "profile-open": "the data set {parameter} no {sides} limit within a factor of {reach:.0e}",
    "chain-short": "the Markov chain is short ({chain}); its intervals are rough",
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
