"""A soft arm in one call: `move` returns an `ArmResult`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..arrays import Array
from ..errors import InputError, SolveError, argument
from ..findings import Finding
from ..result import Column, Result
from ..strip.actuator import Actuator
from .activation import Activation, passive, sine, stiffening_wave
from .coupling import Coupled, couple
from .dynamics import TOLERANCE, simulate
from .lattice import FORMULATIONS, OCTOPUS, Arm, mounted, strip_arm
from .motion import Event, Motion
from .reach import Reached, reach_target, rhythm_network
from .statics import doubled, equilibrium, lattice_error

if TYPE_CHECKING:
    from xarray import Dataset

#: Amplitude of a sine by formulation: the free strain of the `paper` strip at 4 V, 3 d0 V/b; a level at which the
#: octopus arm bends strongly.
AMPLITUDES = {"beam": 2.21e-3, "chain": 2.21e-3, "yekutieli": 0.02}
#: Period of a sine [s]: as of the two-neuron oscillator at the paper's values.
PERIOD = 1.035463
#: Segments of an arm, and the error of its tip, relative to how far it moves, from which on there are twice as many.
SEGMENTS, LATTICE_ERROR = 15, 0.01
#: Segments up to which a lattice is refined, and up to which its error is computed.
_MOST_REFINED, _MOST_CHECKED = 120, 500
ACTIVATIONS = ("cpg", "sine", "wave")


@dataclass(frozen=True, repr=False, eq=False)
class ArmResult(Result):
    """The motion of a soft arm, as `ilg_circuit.arm` returns it.

    Attributes
    ----------
    motion : Motion
        Positions, forces and energies over time.
    coupled : Coupled or None
        The rhythm that drove the arm, and how it was coupled to the strips.
    reached : Reached or None
        Result of the search for a rhythm that reaches a target, if one was asked for.
    slower : float
        Factor by which the rhythm's time constants were stretched.
    warnings : tuple of str
        Findings as sentences.
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

    def table(self) -> tuple[Column, ...]:
        """Return the table of the motion."""
        return self.motion.table()

    def to_xarray(self) -> Dataset:
        """Return all of the motion as an xarray Dataset, with this result's provenance."""
        return replace(self.motion, provenance=self.provenance).to_xarray()

    def to_dict(self) -> dict[str, Any]:
        """Return the motion, the coupling's time scales and the search's result as plain data."""
        coupled, reached = self.coupled, self.reached
        return {
            "motion": self.motion.to_dict(),
            "coupling": coupled
            and {
                "mode": coupled.mode,
                "period_s": coupled.run.period,
                "largest_strain": coupled.largest_strain,
                "scales": [asdict(scale) for scale in coupled.scales],
            },
            "reached": reached
            and {
                "reached": reached.reached,
                "target_m": reached.target.tolist(),
                "tolerance_m": reached.tolerance,
                "distance_m": reached.distance,
                "time_s": reached.time,
                "nearest_m": reached.nearest.tolist(),
                "parameters": reached.parameters,
                "bounds": {name: list(ends) for name, ends in reached.bounds.items()},
                "share": reached.share,
                "failed": reached.failed,
            },
            "slower": self.slower,
            "warnings": list(self.warnings),
        }


def move(
    strip: Actuator,
    times: Array,
    *,
    segments: int | None = None,
    formulation: str = "beam",
    coupling: str = "ideal",
    activation: str = "cpg",
    rhythm: str = "unit",
    inhibition: float | None = None,
    tonic: float | None = None,
    adaptation: float | None = None,
    rise_time: float | None = None,
    reference: float | None = None,
    slower: float = 1.0,
    neurons_in_circuit: bool = False,
    voltage: float = 4.0,
    reach: Sequence[float] | None = None,
    within: float | None = None,
    seed: int = 0,
    amplitude: float | None = None,
    period: float | None = None,
    mounting: str | None = None,
    settled: bool = False,
    rest_ratio: float | None = None,
    method: str | None = None,
    tolerance: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ArmResult:
    """Return the motion at ``times`` [s] of an arm cut from ``strip``; options as for `ilg_circuit.arm`, in SI units.

    Raises InputError where options contradict one another, SolveError where the motion cannot be computed.
    """
    constants = {"inhibition": inhibition, "tonic": tonic, "adaptation": adaptation, "rise_time": rise_time}
    transfer: dict[str, Any] = {"reference": reference, "slower": slower, "neurons_in_circuit": neurons_in_circuit}
    usual = {"slower": 1.0, "neurons_in_circuit": False}
    of_rhythm = {name: value for name, value in (constants | transfer).items() if value != usual.get(name)}
    given = argument(next(iter(of_rhythm), ""))
    searching, sized, driven = reach is not None, amplitude is not None, activation == "cpg"
    through, tensioned = coupling != "ideal", formulation != "yekutieli" and rest_ratio is not None
    chosen = method not in (None, "auto") or tolerance not in (None, TOLERANCE)
    other, by_rhythm = argument("activation", activation), argument("activation", "cpg")
    contradictions = {
        f"formulation is '{formulation}'; choose one of {', '.join(FORMULATIONS)}": formulation not in FORMULATIONS,
        f"activation is '{activation}'; choose one of {', '.join(ACTIVATIONS)}": activation not in ACTIVATIONS,
        f"{argument('within')} goes with {argument('reach')}": within is not None and not searching,
        f"{argument('reach')} searches for a rhythm; it does not go with {other}": searching and not driven,
        f"{argument('amplitude')} belongs to a sine; {argument('reach')} searches for a rhythm": searching and sized,
        f"{argument('reach')} finds the rhythm's parameters itself; leave out {given}": searching and given,
        f"{argument('reach')} chooses method and tolerance itself; leave out {argument('method')} and "
        f"{argument('tolerance')}": searching and chosen,
        f"{given} belongs to {by_rhythm}": given and not driven,
        f"{argument('amplitude')} belongs to a sine; a rhythm's is set by {argument('voltage')}": driven and sized,
        f"{argument('coupling', coupling)} goes with {by_rhythm}; a {activation} is ideal": not driven and through,
        f"{argument('amplitude')} belongs to a sine; the wave has its own levels": activation == "wave" and sized,
        f"{argument('rest_ratio')} is the pre-tension of yekutieli; the {formulation} formulation has none": tensioned,
    }
    for message, found in contradictions.items():
        if found:
            raise InputError(message)
    seconds = float(times[-1])
    count = SEGMENTS if segments is None else segments
    body = _body(strip, formulation, count, mounting, rest_ratio)
    through_strip: dict[str, Any] = {
        "mode": coupling,
        "actuator": strip,
        "voltage": voltage,
    }
    coupled = None
    if searching:
        drive = passive(body)
    elif driven:
        network = rhythm_network(rhythm, count, **constants)
        coupled = couple(network, count, seconds, **through_strip, **transfer)
        drive = coupled.activation(body)
    elif activation == "wave":
        drive = stiffening_wave(body, seconds)
    else:
        swing = AMPLITUDES[body.formulation] if amplitude is None else amplitude
        drive = sine(body, swing, PERIOD if period is None else period, seconds)
    told: tuple[Event, ...] = ()
    if formulation == "beam" and not searching:
        body, drive, told = _fine(body, drive, refining=segments is None)
    start = None
    if settled:
        positions, _ = equilibrium(body, drive)
        start = positions, 0.0 * positions
    how: dict[str, Any] = {"start": start, "progress": progress}
    if reach is not None:
        where: dict[str, Any] = {"rhythm_of": rhythm, "times": times, "tolerance": within, "seed": seed}
        reached = reach_target(body, reach, seconds, **where, **through_strip, **how)
        return ArmResult(reached.motion, reached.coupled, reached)
    tolerance = TOLERANCE if tolerance is None else tolerance
    motion = simulate(body, drive, times, method=method or "auto", tolerance=tolerance, **how)
    motion = replace(motion, events=(*told, *motion.events))
    if coupled:
        waves = coupled.signals(motion.time).items()
        each = body.segments // count
        motion = replace(motion, signals={name: np.repeat(values, each, axis=1) for name, values in waves})
    return ArmResult(motion, coupled, slower=slower)


def _fine(body: Arm, drive: Activation, *, refining: bool) -> tuple[Arm, Activation, tuple[Event, ...]]:
    """Return a lattice and its drive, of twice the segments until its error is small where that is asked for, and that.

    The error is not stated where no equilibrium is found, or of so many segments that it is nothing.
    """
    if body.segments > _MOST_CHECKED:
        return body, drive, ()
    try:
        error = lattice_error(body, drive)
        while refining and error > LATTICE_ERROR and 2 * body.segments <= _MOST_REFINED:
            body, drive = doubled(body, drive)
            error = lattice_error(body, drive)
    except SolveError:
        return body, drive, ()
    values = {"segments": body.segments, "twice": 2 * body.segments, "error": error}
    return body, drive, (Event(0.0, Finding("arm-lattice-error", values=values)),)


def _body(strip: Actuator, formulation: str, segments: int, mounting: str | None, rest_ratio: float | None) -> Arm:
    if formulation != "yekutieli":
        return replace(strip_arm(strip, segments=segments, mounting=mounting), formulation=formulation)
    body = replace(OCTOPUS, segments=segments)
    if rest_ratio is not None:
        body = replace(body, muscle=replace(body.muscle, rest_ratio=rest_ratio))
    return mounted(body, mounting) if mounting else body
