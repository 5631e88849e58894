"""A soft arm in one call: `arm` returns an `ArmResult`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from ..arrays import Array
from ..cpg.network import INHIBITION, Network, chain, ring, unit
from ..errors import InputError
from ..findings import Finding
from ..result import Result
from ..simulation.response import sample_times
from ..strip.actuator import Actuator
from ..strip.file import load_actuator
from ..units import parse
from .activation import Activation, passive, sine, stiffening_wave
from .coupling import Coupled, couple
from .dynamics import TOLERANCE, simulate
from .lattice import GRAVITY, OCTOPUS, Arm, strip_arm
from .motion import Motion
from .reach import RHYTHMS, Reached, reach_target
from .statics import equilibrium

#: Amplitude of a sine by formulation: the free strain of the `paper` strip at 4 V, 3 d0 V/b; a level at which the
#: octopus arm bends strongly.
AMPLITUDES = {"beam": 2.21e-3, "yekutieli": 0.02}
#: Period of a sine [s]: as of the two-neuron oscillator at the paper's values.
PERIOD = 1.035463
ACTIVATIONS = ("cpg", "sine", "wave")


@dataclass(frozen=True, eq=False)
class ArmResult(Result):
    """A motion, the rhythm that drove it, if any, and the result of a search for a target, if asked for.

    ``slower`` is the factor by which the rhythm's time constants were stretched.
    """

    presenter: ClassVar[str] = "arm"

    motion: Motion
    coupled: Coupled | None = None
    reached: Reached | None = None
    slower: float = 1.0

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of the rhythm, its coupling and the motion."""
        return (*(self.coupled.findings if self.coupled else ()), *self.motion.findings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as sentences, those of the motion with their times."""
        return (*(self.coupled.warnings if self.coupled else ()), *self.motion.warnings)

    def save(self, path: str | Path) -> None:
        """Write the motion as netCDF, with this result's provenance. Raises InputError where that is impossible."""
        replace(self.motion, provenance=self.provenance).write(path)


def arm(
    duration: str | float,
    *,
    actuator: str | Path | Actuator = "paper",
    segments: int = 15,
    formulation: str = "beam",
    coupling: str = "ideal",
    activation: str = "cpg",
    rhythm: str = "unit",
    inhibition: float | None = None,
    tonic: float | None = None,
    adaptation: float | None = None,
    rise_time: str | float | None = None,
    reference: float | None = None,
    slower: float = 1.0,
    neurons_in_circuit: bool = False,
    voltage: str | float = "4V",
    reach: str | None = None,
    within: str | float | None = None,
    seed: int = 0,
    amplitude: float | None = None,
    period: str | float = PERIOD,
    mounting: str | None = None,
    settled: bool = False,
    rest_ratio: float | None = None,
    method: str | None = None,
    tolerance: float | None = None,
    samples: int | None = None,
    step: str | float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ArmResult:
    """Move an arm over ``duration``, or find the rhythm that brings its tip to ``reach``, such as ``29mm,4mm``.

    Parameters
    ----------
    duration, samples, step
        Texts such as ``3s``, or seconds; ``samples`` (default 601), or the ``step`` between them.
    actuator, segments, formulation, mounting, rest_ratio
        The arm: a ``beam`` cut from a strip, or ``yekutieli``'s octopus arm with the pre-tension ``rest_ratio``.
    coupling, voltage, slower, reference, neurons_in_circuit
        From rhythm to strain, as in `coupling.couple`.
    activation, rhythm, inhibition, tonic, adaptation, rise_time
        ``cpg``: a network of `reach.RHYTHMS` and its constants; ``sine``: of ``amplitude`` and ``period``; ``wave``:
        the octopus' wave of stiffness.
    within, seed
        Tolerance and seed of the search, as in `reach.reach_target`.
    settled
        Begin in equilibrium under the weight, not in the rest shape.
    method, tolerance
        As in `dynamics.simulate`.
    progress
        Called with (done, total).

    Raises
    ------
    InputError
        For values out of range, and for arguments that contradict one another.
    SolveError
        Where the motion cannot be computed.
    """
    rhythm_given = {
        "inhibition": inhibition,
        "tonic": tonic,
        "adaptation": adaptation,
        "rise-time": rise_time,
        "reference": reference,
        "slower": slower if slower != 1.0 else None,
        "neurons-in-circuit": neurons_in_circuit or None,
    }
    given = [name for name, value in rhythm_given.items() if value is not None]
    _require_consistent(activation, reach, within, amplitude, method not in (None, "auto"), tolerance, given)
    seconds = _quantity(duration, "s", "--duration")
    times = sample_times(seconds, samples=samples, step=None if step is None else _quantity(step, "s", "--step"))
    strip = actuator if isinstance(actuator, Actuator) else load_actuator(actuator)
    body = _body(strip, formulation, segments, mounting, rest_ratio)
    volts = _quantity(voltage, "V", "--voltage")
    if reach is not None:
        found = reach_target(
            body,
            _target(reach),
            seconds,
            rhythm_of=rhythm,
            mode=coupling,
            actuator=strip,
            voltage=volts,
            times=times,
            tolerance=None if within is None else _quantity(within, "m", "--within"),
            start=_start(body, passive(body), settled),
            seed=seed,
            progress=progress,
        )
        return ArmResult(found.motion, found.coupled, found)
    coupled = None
    if activation == "cpg":
        if amplitude is not None:
            raise InputError("--amplitude is that of a sine; a rhythm's is set by --voltage")
        constants: dict[str, Any] = {"tonic": tonic, "adaptation": adaptation}
        constants["rise_time"] = None if rise_time is None else _quantity(rise_time, "s", "--rise-time")
        coupled = couple(
            _network(rhythm, segments, INHIBITION if inhibition is None else inhibition, constants),
            segments,
            seconds,
            mode=coupling,
            actuator=strip,
            segment_length=body.segment_length if formulation == "beam" else None,
            voltage=volts,
            slower=slower,
            reference=reference,
            neurons_in_circuit=neurons_in_circuit,
        )
        drive = coupled.activation(body)
    else:
        drive = _prescribed(body, activation, coupling, amplitude, _quantity(period, "s", "--period"), seconds)
    motion = simulate(
        body,
        drive,
        times,
        method=method or "auto",
        tolerance=TOLERANCE if tolerance is None else tolerance,
        start=_start(body, drive, settled),
        progress=progress,
    )
    if coupled:
        motion = replace(motion, signals=coupled.signals(motion.time))
    return ArmResult(motion, coupled, slower=slower)


def _quantity(value: str | float, unit: str, name: str) -> float:
    return parse(value, unit, name) if isinstance(value, str) else float(value)


def _require_consistent(
    activation: str,
    reach: str | None,
    within: str | float | None,
    amplitude: float | None,
    chosen_method: bool,
    tolerance: float | None,
    given: list[str],
) -> None:
    """Raise InputError for arguments that contradict one another; ``given`` are those of a rhythm."""
    if activation not in ACTIVATIONS:
        raise InputError(f"activation is '{activation}'; choose one of {', '.join(ACTIVATIONS)}")
    if reach is None:
        if within is not None:
            raise InputError("--within goes with --reach")
    elif activation != "cpg":
        raise InputError(f"--reach looks for a rhythm; it does not go with --activation {activation}")
    elif amplitude is not None:
        raise InputError("--amplitude is that of a sine; --reach looks for a rhythm")
    elif given:
        raise InputError(f"--reach finds the rhythm's parameters itself; leave out --{given[0]}")
    elif chosen_method or tolerance not in (None, TOLERANCE):
        raise InputError("--reach chooses method and tolerance itself; leave out --method and --tolerance")
    if activation != "cpg" and given:
        raise InputError(f"--{given[0]} belongs to --activation cpg")


def _target(text: str) -> list[float]:
    cells = text.split(",")
    if len(cells) != 2:
        raise InputError(f"--reach '{text[:40]}' is no place; write x,y with units, such as 29mm,4mm")
    return [parse(cell, "m", f"--reach {axis}") for cell, axis in zip(cells, "xy", strict=True)]


def _body(strip: Actuator, formulation: str, segments: int, mounting: str | None, rest_ratio: float | None) -> Arm:
    if formulation == "beam":
        if rest_ratio is not None:
            raise InputError("--rest-ratio is the pre-tension of yekutieli; the beam formulation has none")
        return strip_arm(strip, segments=segments, mounting=mounting)
    body = replace(OCTOPUS, segments=segments)
    if rest_ratio is not None:
        body = replace(body, muscle=replace(body.muscle, rest_ratio=rest_ratio))
    if mounting:
        gravity = (0.0, 0.0 if mounting == "weightless" else -GRAVITY)
        body = replace(body, gravity=gravity, direction=-math.pi / 2 if mounting == "hanging" else 0.0)
    return body


def _network(rhythm: str, segments: int, inhibition: float, constants: dict[str, Any]) -> Network:
    """Return a network of `RHYTHMS` with the ``constants`` that are not None."""
    known = {name: value for name, value in constants.items() if value is not None}
    if rhythm not in RHYTHMS:
        raise InputError(f"rhythm is '{rhythm}'; choose one of {', '.join(RHYTHMS)}")
    if rhythm == "unit":
        return unit(inhibition, **known)
    if rhythm == "chain":
        return chain(segments, inhibition, **known)
    return ring(3, inhibition, one_way=rhythm == "one-way-ring", **known)


def _start(body: Arm, drive: Activation, settled: bool) -> tuple[Array, Array] | None:
    """Return positions and velocities at the start, None for the rest shape."""
    if not settled:
        return None
    positions, _ = equilibrium(body, drive)
    return positions, 0.0 * positions


def _prescribed(
    body: Arm, activation: str, coupling: str, amplitude: float | None, period: float, duration: float
) -> Activation:
    """Return an activation without a rhythm and without a circuit."""
    if coupling != "ideal":
        raise InputError(f"--coupling {coupling} goes with --activation cpg; a {activation} is ideal")
    if activation == "wave":
        if amplitude is not None:
            raise InputError("--amplitude is that of the sine; the wave has its own levels")
        return stiffening_wave(body, duration)
    return sine(body, AMPLITUDES[body.formulation] if amplitude is None else amplitude, period, duration)
