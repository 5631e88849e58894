"""The soft arm: what users give, as `arms.run.move` takes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..errors import InputError, argument, checked
from ..extras import require_arm
from ..simulation.response import sample_times
from ..units import si
from .given import Given, Strip, load, optional, quantity

if TYPE_CHECKING:
    from ..arms.run import ArmResult


@checked
def arm(
    duration: Given,
    strip: Strip = "paper",
    *,
    segments: int | None = None,
    formulation: str = "beam",
    coupling: str = "ideal",
    activation: str = "cpg",
    rhythm: str = "unit",
    inhibition: float | None = None,
    tonic: float | None = None,
    adaptation: float | None = None,
    rise_time: Given | None = None,
    reference: float | None = None,
    slower: float = 1.0,
    neurons_in_circuit: bool = False,
    voltage: Given = "4V",
    reach: str | Sequence[Given] | None = None,
    within: Given | None = None,
    seed: int = 0,
    amplitude: float | None = None,
    period: Given | None = None,
    mounting: str | None = None,
    settled: bool = False,
    rest_ratio: float | None = None,
    method: str | None = None,
    tolerance: float | None = None,
    samples: int | None = None,
    step: Given | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ArmResult:
    """Return the motion of a soft arm that a rhythm, a sine or a wave drives, or of one that reaches a place.

    Parameters
    ----------
    duration : float or str
        Duration of the motion [s], or a text such as "3 s".
    strip : Actuator, str or Path
        Strip from which the arm is cut: an object, the path of a TOML file or a preset's name.
    segments : int, optional
        Number of segments (default: 15; of a lattice twice as many, each two under one strain, until its error at rest
        is below 1 % of the tip's displacement).
    formulation : {"beam", "chain", "yekutieli"}
        "beam" is the free part of a strip as a lattice, "chain" the same as a chain of arcs, "yekutieli" an octopus arm
        of muscles in water.
    coupling : {"ideal", "circuit", "charge"}
        How outputs of neurons become strain: in proportion (ideal), through the circuits of the strips, or through
        their charge alone.
    activation : {"cpg", "sine", "wave"}
        What drives the segments.
    rhythm : str
        Network of the neurons: "unit", "ring", "one-way-ring" or "chain".
    inhibition : float, optional
        Weight between neurons.
    tonic : float, optional
        Tonic input of the neurons.
    adaptation : float, optional
        How strongly neurons fatigue.
    rise_time : float or str, optional
        Time constant of the neurons' state [s].
    reference : float, optional
        Output of a neuron at which strips get ``voltage`` (default: the amplitude of the rhythm).
    slower : float
        Factor by which the rhythm's time constants are stretched.
    neurons_in_circuit : bool
        Solves the neurons in the circuit of the strips.
    voltage : float or str
        Largest voltage of a segment [V].
    reach : str or pair, optional
        Place (x, y) [m] that the tip is to reach, such as "29mm,4mm"; the rhythm is searched for.
    within : float or str, optional
        How near the tip must come [m].
    seed : int
        Seed of the search.
    amplitude : float, optional
        Amplitude of a sine: largest strain, or activation of the octopus arm.
    period : float or str, optional
        Period of a sine [s].
    mounting : str, optional
        How the arm is held against gravity (default: as the strip).
    settled : bool
        Begins in equilibrium under the weight, not in the rest shape.
    rest_ratio : float, optional
        Pre-tension of the octopus arm's muscles.
    method : str, optional
        Integrator: "explicit", "implicit" or "auto".
    tolerance : float, optional
        Relative error allowed in a step of the integrator.
    samples : int, optional
        Number of samples (default 601).
    step : float or str, optional
        Time between samples [s], in place of their number.
    progress : callable, optional
        Function that is called with (done, total).

    Returns
    -------
    ArmResult
        ``moved.motion`` has ``time`` [s], ``tip`` (t, 2) [m] and other arrays; ``moved.coupled`` is the rhythm. See
        `ilg.results`.

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
    require_arm()
    from ..arms.run import move

    seconds = quantity(duration, "s", "duration")
    return move(
        load(strip),
        sample_times(seconds, samples=samples, step=optional(step, "s", "step")),
        segments=segments,
        formulation=formulation,
        coupling=coupling,
        activation=activation,
        rhythm=rhythm,
        inhibition=inhibition,
        tonic=tonic,
        adaptation=adaptation,
        rise_time=optional(rise_time, "s", "rise_time"),
        reference=reference,
        slower=slower,
        neurons_in_circuit=neurons_in_circuit,
        voltage=quantity(voltage, "V", "voltage"),
        reach=None if reach is None else _place(reach),
        within=optional(within, "m", "within"),
        seed=seed,
        amplitude=amplitude,
        period=optional(period, "s", "period"),
        mounting=mounting,
        settled=settled,
        rest_ratio=rest_ratio,
        method=method,
        tolerance=tolerance,
        progress=progress,
    )


def _place(given: str | Sequence[Given]) -> list[float]:
    cells = given.split(",") if isinstance(given, str) else list(given) if isinstance(given, Sequence) else []
    if len(cells) != 2:
        shown = given[:40] if isinstance(given, str) else given
        raise InputError(f"{argument('reach')} '{shown}' is not a place; write x,y with units, such as 29mm,4mm")
    return [si(cell, "m", f"{argument('reach')} {axis}") for cell, axis in zip(cells, "xy", strict=True)]
