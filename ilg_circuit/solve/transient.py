"""Transients to a stated accuracy: many netlists at once, by ngspice (see `stepped`) or exactly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..circuit.netlist import Netlist
from ..drive import Drive, PiecewiseLinear, voltage_limit
from ..errors import InputError, argument
from .limited import limited_run
from .modes import fastest_modes, similar
from .sampling import sampled_times
from .state_space import StateSpace, state_space
from .stepped import Batch
from .work import Named, Work, exact_with_work

Progress = Callable[[int, int], None]

#: Default accuracy: error relative to each waveform's largest value.
DEFAULT_ACCURACY = 1e-7

#: Number of samples at which the exact engine's rounding is estimated, and factor for the other samples.
_COMPARED, _LIKELY = 40, 10.0
#: Error of the exact engine by modes up to which exponentials are not tried.
_ROUNDED_LITTLE = 1e-6


@dataclass(frozen=True)
class Waveforms:
    """Outputs of ``n`` netlists at the same times.

    ``times`` [s] (t,); ``values`` (n, outputs, t) in the outputs' units; ``errors`` (n, outputs): estimated error
    relative to the waveform's largest value (the exact engine's is its rounding); ``engine`` is the solver's name.
    """

    times: Array
    values: Array
    errors: Array
    names: tuple[str, ...]
    engine: str

    def output(self, name: str, copy: int = 0) -> Array:
        """Return one waveform (t,)."""
        return np.asarray(self.values[copy, self.names.index(name)])


def transient(
    netlists: Netlist | Sequence[Netlist],
    drive: Drive,
    times: ArrayLike,
    *,
    engine: str = "ngspice",
    accuracy: float = DEFAULT_ACCURACY,
    acceptable: float | None = None,
    interpolate: bool = True,
    works: Sequence[Work] = (),
    progress: Progress | None = None,
) -> Waveforms:
    """Solve netlists of one topology under ``drive`` from its rest, and sample their outputs at ``times`` [s].

    ``accuracy`` is the error allowed, relative to each waveform's largest value (1e-11 to 1e-2). A sample at t = 0 or
    on an edge of the drive is the right limit. ``acceptable`` is an error that is a result too where the accuracy is
    not reached (default: none beyond it). ``interpolate=False`` makes every sample a point of the solve. ``works`` are
    integrals of the outputs, which they follow as further outputs. ``progress(done, total)`` is called after each piece
    of work. Raises InputError for times that are not ascending and >= 0, SolveError when the accuracy is not reached.
    """
    nets = [netlists] if isinstance(netlists, Netlist) else list(netlists)
    if not nets:
        raise InputError("a transient needs at least one netlist")
    samples = sampled_times(drive, times, len(nets[0].sources))
    if not 1e-11 <= accuracy <= 1e-2:
        raise InputError(f"accuracy {accuracy:g} must lie between 1e-11 and 1e-2")
    if engine == "ngspice" and samples[-1] in drive.jumps(np.inf):
        # a jump on the last sample: its right limit needs a run that goes beyond
        beyond = transient(
            nets, drive, np.append(samples, samples[-1] * 1.001), engine=engine, accuracy=accuracy,
            acceptable=acceptable, interpolate=interpolate, works=works, progress=progress,
        )  # fmt: skip
        return replace(beyond, times=samples, values=beyond.values[:, :, :-1])
    if drive.rest != nets[0].rest and not nets[0].linear:
        raise InputError(f"the circuit starts at rest under {nets[0].rest:g} V, the drive from {drive.rest:g} V")
    if (limit := voltage_limit(drive)) is not None:
        return Waveforms(samples, *limited_run(nets, drive, limit, samples, works, engine), "exact")
    for netlist in nets:
        netlist.require_rising(netlist.voltage_at(drive.largest()))
    system = state_space([netlist.linearised() for netlist in nets])
    if drive.rest and nets[0].linear:
        assert isinstance(drive, PiecewiseLinear)
        rest, steady = drive.rest, drive.rest * system.steady()[..., None]

        def about_rest(work: Work) -> Work:
            def power(voltage: Array, of: Named) -> Array:
                return work.power(voltage + rest, lambda name: of(name) + steady[:, system.output_names.index(name)])

            return replace(work, power=power)

        moved = transient(
            nets, drive.from_rest(), samples, engine=engine, accuracy=accuracy, acceptable=acceptable,
            interpolate=interpolate, works=[about_rest(work) for work in works], progress=progress,
        )  # fmt: skip
        moved.values[:, : steady.shape[1]] += steady
        return moved
    names = (*system.output_names, *(work.name for work in works))
    if engine == "exact":
        if not nets[0].linear:
            raise InputError(
                "the exact engine solves linear circuits only, and this one is not; "
                f"use {argument('engine', 'ngspice')}"
            )
        return Waveforms(samples, *_exactly(nets[0], system, drive, samples, works), names, "exact")
    if engine != "ngspice":
        raise InputError(f"engine is '{engine}'; choose ngspice or exact")
    if samples[-1] == 0:
        # only the start is asked for: one point later there is something to solve
        soon = [0.0, 1e-6 / fastest_modes(system).max()]
        longer = transient(nets, drive, soon, engine=engine, accuracy=accuracy, works=works)
        return Waveforms(samples, longer.values[:, :, :1], longer.errors, longer.names, longer.engine)
    poles = system.poles()
    if not nets[0].linear:  # the grid must suit the modes at rest and those at the drive's peak
        at_peak = state_space([netlist.linearised(netlist.voltage_at(drive.largest())) for netlist in nets])
        poles = np.concatenate([poles, at_peak.poles()], axis=1)
    values = np.empty((len(nets), len(names), len(samples)))
    errors = np.empty(values.shape[:2])
    done = 0
    for members in similar(fastest_modes(system)):
        batch = Batch([nets[k] for k in members], drive, accuracy, works, system.of(members))
        found = batch.solved(poles[members].ravel(), samples, acceptable or accuracy, interpolate)
        values[members], errors[members] = found
        done += len(members)
        if progress:
            progress(done, len(nets))
    return Waveforms(samples, values, errors, names, "ngspice")


def _exactly(
    netlist: Netlist, system: StateSpace, drive: Drive, samples: Array, works: Sequence[Work]
) -> tuple[Array, Array]:
    """Return values and errors by the exact engine: by exponentials where these are rounded less than modes."""
    judged = [*(not output.probe for output in netlist.outputs), *(not work.probe for work in works)]
    found, least = (np.empty(0), np.empty(0)), np.inf
    for modes in (True, False):
        values = exact_with_work(system, drive, samples, works, modes=modes)
        errors = _rounding(netlist, drive, samples, works, values, modes=modes)
        if (worst := float(errors[:, judged].max(initial=0.0))) < least:
            found, least = (values, errors), worst
        if worst <= _ROUNDED_LITTLE:
            break
    return found


def _rounding(
    netlist: Netlist, drive: Drive, samples: Array, works: Sequence[Work], values: Array, *, modes: bool
) -> Array:
    """Return errors (n, outputs) of the exact engine: the change by another order of the first netlist's elements."""
    some = np.unique(np.linspace(0, len(samples) - 1, _COMPARED).astype(int))
    other = state_space([replace(netlist, elements=netlist.elements[::-1])])
    again = exact_with_work(other, drive, samples[some], works, modes=modes)
    difference = np.abs(again - values[:1, :, some]).max(axis=2)
    scale = np.abs(values).max(axis=2)
    errors = np.divide(difference, scale[:1], out=np.zeros_like(difference), where=scale[:1] > 0)
    return np.where(scale > 0, _LIKELY * (errors + 5e-14), 0.0)
