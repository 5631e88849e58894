"""A soft arm in one call: `arm` returns an `ArmResult`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import InputError
from ..findings import Finding
from ..result import Column, Result
from ..simulation.response import sample_times
from ..strip.actuator import Actuator
from ..strip.file import load_actuator
from ..units import parse, si
from .activation import passive, sine, stiffening_wave
from .coupling import Coupled, couple
from .dynamics import TOLERANCE, simulate
from .lattice import OCTOPUS, Arm, mounted, strip_arm
from .motion import Motion
from .reach import Reached, reach_target, rhythm_network
from .statics import equilibrium

if TYPE_CHECKING:
    from xarray import Dataset

#: Amplitude of a sine by formulation: the free strain of the `paper` strip at 4 V, 3 d0 V/b; a level at which the
#: octopus arm bends strongly.
AMPLITUDES = {"beam": 2.21e-3, "yekutieli": 0.02}
#: Period of a sine [s]: as of the two-neuron oscillator at the paper's values.
PERIOD = 1.035463
ACTIVATIONS = ("cpg", "sine", "wave")


@dataclass(frozen=True, repr=False, eq=False)
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


def arm(
    duration: str | float,
    strip: str | Path | Actuator = "paper",
    *,
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
    """Return the motion of a soft arm that a rhythm, a sine or a wave drives, or of one that reaches a place.

    Parameters
    ----------
    duration : float or str
        How long: seconds, or a text such as "3 s".
    strip : Actuator, str or Path
        What the arm is cut from: an object, the path of a TOML file or a preset's name.
    segments : int
        Number of segments.
    formulation : {"beam", "yekutieli"}
        The free part of a strip, or the octopus arm.
    coupling : {"ideal", "circuit", "charge"}
        How outputs of neurons become strain: directly, or through the circuits of the strips.
    activation : {"cpg", "sine", "wave"}
        What drives the segments.
    rhythm : str
        Network of a rhythm: "unit", "chain" and others of `arms.reach.RHYTHMS`.
    inhibition : float, optional
        Weight between neurons.
    tonic : float, optional
        Tonic input of the neurons.
    adaptation : float, optional
        How strongly neurons fatigue.
    rise_time : float or str, optional
        Time constant of the neurons' state [s].
    reference : float, optional
        Output of a neuron that stands for ``voltage``.
    slower : float
        Factor by which the rhythm's time constants are stretched.
    neurons_in_circuit : bool
        Solves the neurons in the circuit of the strips.
    voltage : float or str
        Largest voltage of a segment [V].
    reach : str, optional
        Place that the tip is to come to, such as "29mm,4mm"; the rhythm is looked for.
    within : float or str, optional
        How near the tip must come [m].
    seed : int
        Of the search.
    amplitude : float, optional
        Of a sine: largest strain, or activation of the octopus arm.
    period : float or str
        Of a sine [s].
    mounting : str, optional
        How the arm is held against gravity (default: as the strip).
    settled : bool
        Begins in equilibrium under the weight, not in the rest shape.
    rest_ratio : float, optional
        Pre-tension of the octopus arm's muscles.
    method : str, optional
        Integrator: "explicit", "implicit" or "auto".
    tolerance : float, optional
        Of the integrator, relative.
    samples : int, optional
        Number of samples (default 601).
    step : float or str, optional
        Time between samples [s], in place of their number.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    ArmResult
        The motion, and the rhythm that drove it.

    Raises
    ------
    InputError
        A value is out of range, or arguments contradict one another.
    SolveError
        The motion cannot be computed.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> moved = ilg.arm("20 ms", segments=5, activation="sine")
    >>> moved.motion.tip.shape
    (601, 2)
    """
    constants = {"inhibition": inhibition, "tonic": tonic, "adaptation": adaptation, "rise_time": rise_time}
    transfer: dict[str, Any] = {"reference": reference, "slower": slower, "neurons_in_circuit": neurons_in_circuit}
    usual = {"slower": 1.0, "neurons_in_circuit": False}
    of_rhythm = {name: value for name, value in (constants | transfer).items() if value != usual.get(name)}
    given = next(iter(of_rhythm), "").replace("_", "-")
    searching, sized, driven = reach is not None, amplitude is not None, activation == "cpg"
    through, tensioned = coupling != "ideal", formulation == "beam" and rest_ratio is not None
    chosen = method not in (None, "auto") or tolerance not in (None, TOLERANCE)
    contradictions = {
        f"activation is '{activation}'; choose one of {', '.join(ACTIVATIONS)}": activation not in ACTIVATIONS,
        "--within goes with --reach": within is not None and not searching,
        f"--reach looks for a rhythm; it does not go with --activation {activation}": searching and not driven,
        "--amplitude is that of a sine; --reach looks for a rhythm": searching and sized,
        f"--reach finds the rhythm's parameters itself; leave out --{given}": searching and given,
        "--reach chooses method and tolerance itself; leave out --method and --tolerance": searching and chosen,
        f"--{given} belongs to --activation cpg": given and not driven,
        "--amplitude is that of a sine; a rhythm's is set by --voltage": driven and sized,
        f"--coupling {coupling} goes with --activation cpg; a {activation} is ideal": not driven and through,
        "--amplitude is that of the sine; the wave has its own levels": activation == "wave" and sized,
        "--rest-ratio is the pre-tension of yekutieli; the beam formulation has none": tensioned,
    }
    for message, found in contradictions.items():
        if found:
            raise InputError(message)
    seconds = si(duration, "s", "--duration")
    times = sample_times(seconds, samples=samples, step=None if step is None else si(step, "s", "--step"))
    cut = strip if isinstance(strip, Actuator) else load_actuator(strip)
    body = _body(cut, formulation, segments, mounting, rest_ratio)
    through_strip: dict[str, Any] = {"mode": coupling, "actuator": cut, "voltage": si(voltage, "V", "--voltage")}
    coupled = None
    if searching:
        drive = passive(body)
    elif driven:
        network = rhythm_network(rhythm, segments, **constants)
        coupled = couple(network, segments, seconds, **through_strip, **transfer)
        drive = coupled.activation(body)
    elif activation == "wave":
        drive = stiffening_wave(body, seconds)
    else:
        swing = AMPLITUDES[body.formulation] if amplitude is None else amplitude
        drive = sine(body, swing, si(period, "s", "--period"), seconds)
    start = None
    if settled:
        positions, _ = equilibrium(body, drive)
        start = positions, 0.0 * positions
    how: dict[str, Any] = {"start": start, "progress": progress}
    if reach is not None:
        near = None if within is None else si(within, "m", "--within")
        target = _target(reach)
        reached = reach_target(
            body, target, seconds, rhythm_of=rhythm, times=times, tolerance=near, seed=seed, **through_strip, **how
        )
        return ArmResult(reached.motion, reached.coupled, reached)
    tolerance = TOLERANCE if tolerance is None else tolerance
    motion = simulate(body, drive, times, method=method or "auto", tolerance=tolerance, **how)
    if coupled:
        motion = replace(motion, signals=coupled.signals(motion.time))
    return ArmResult(motion, coupled, slower=slower)


def _target(text: str) -> list[float]:
    cells = text.split(",")
    if len(cells) != 2:
        raise InputError(f"--reach '{text[:40]}' is no place; write x,y with units, such as 29mm,4mm")
    return [parse(cell, "m", f"--reach {axis}") for cell, axis in zip(cells, "xy", strict=True)]


def _body(strip: Actuator, formulation: str, segments: int, mounting: str | None, rest_ratio: float | None) -> Arm:
    if formulation == "beam":
        return strip_arm(strip, segments=segments, mounting=mounting)
    body = replace(OCTOPUS, segments=segments)
    if rest_ratio is not None:
        body = replace(body, muscle=replace(body.muscle, rest_ratio=rest_ratio))
    return mounted(body, mounting) if mounting else body
