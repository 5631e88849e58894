"""From a rhythm through the strips' circuits to the strains that move an arm; CPG §6, with the circuit of EC between.

    CPG output -> u_i = Vmax clip(out_i/A_ref, -1, 1) -> the strip's circuit, one a segment
               -> free strain eps_i = b y1/L_F^2 = 3 d(s) v_p/b, positive towards the anode

Three modes: ``ideal`` takes the circuit out, eps = eps_max out/A_ref; ``charge`` keeps its R-C lag alone, eps = eps_max
q/(C Vmax); ``circuit`` is the whole chain, with the coupling d(s). eps_max = 3 d0 Vmax/b is the free strain that Vmax
gives in the end. A segment's strip is as long as the segment; its time constants are the strip's. A unit of the network
drives the segments nearest to its place along the arm: one unit drives them all. A_ref is the oscillator's free
amplitude, or a given one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, ComplexArray
from ..circuit.strip import strip_netlist
from ..errors import InputError, wrong_choice
from ..findings import Finding, Warned
from ..oscillators.network import Network
from ..oscillators.rhythm import rhythm as rhythm_of
from ..oscillators.run import RhythmRun
from ..oscillators.run import run as run_network
from ..solve.spectrum import spectrum
from ..strip.actuator import PAPER, Actuator
from ..strip.electrodes import require_lump
from ..strip.elements import lumped_elements
from ..units import require_positive
from .activation import Activation, activation, resampled
from .circuits import through_circuits, with_neurons
from .lattice import Arm

MODES = ("ideal", "circuit", "charge")
#: The paper's voltage [V]; also the edge of its liquid's electrochemical window.
LARGEST_VOLTAGE = 4.0
#: Below this part of its ideal amplitude a rhythm has not passed through the circuit.
PASSED = 0.7
#: Samples of a rhythm in a period: straight lines between them are right to 5e-6.
_SAMPLES = 1000
_MOST_SAMPLES = 2_000_000


@dataclass(frozen=True)
class TimeScale:
    """Transfer of a rhythm of ``period`` [s] by the mode: fraction of the ideal amplitude kept, and phase [deg]."""

    period: float
    kept: float
    phase: float


@dataclass(frozen=True)
class Coupled(Warned):
    """Signals from rhythm to strain at ``time`` [s] (t,), each (t, n) for n segments.

    ``outputs`` of the network; ``voltages`` [V]; ``charges`` [C] on each segment's ion path (zero in ``ideal`` mode);
    ``strains``, free, of the face towards the cathode. ``scales``: the rhythm as it is, ten and a hundred times slower.
    ``error`` is ngspice's estimated error of the strains relative to their largest.
    """

    mode: str
    run: RhythmRun
    time: Array
    outputs: Array
    voltages: Array
    charges: Array
    strains: Array
    largest_strain: float
    scales: tuple[TimeScale, ...]
    error: float

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of the rhythm, and one where it does not pass through the circuit."""
        findings = list(self.run.findings)
        if self.run.period is None:
            findings.append(Finding("arm-still"))
        if self.scales and self.scales[0].kept < PASSED:
            scale = self.scales[0]
            values = {"kept": scale.kept, "period": scale.period, "least": PASSED}
            findings.append(Finding("arm-circuit-lag", values=values))
        return tuple(findings)

    def signals(self, times: ArrayLike) -> dict[str, Array]:
        """Return the outputs, voltages and charges at ``times`` [s] (k,), each (k, n), for a `Motion`."""
        found = {"outputs": self.outputs, "voltages": self.voltages, "charges": self.charges}
        return {name: resampled(times, self.time, waves) for name, waves in found.items()}

    def portrait(self, times: ArrayLike) -> tuple[Array, Array]:
        """Return the outputs of the first unit's two neurons at ``times`` [s] (k,): the rhythm's phase portrait."""
        first, second = resampled(times, self.time, self.run.outputs[:, self.run.network.units[0]]).T
        return first, second

    def activation(self, arm: Arm) -> Activation:
        """Return the activation of an ``arm``: strains of a beam, for yekutieli's muscles over the largest one."""
        values = driving(arm, self.strains, self.largest_strain)
        return activation(arm, self.time, values, f"{self.mode} coupling to {len(self.run.network.units)} unit(s)")


def driving(arm: Arm, strains: Array, largest: float) -> Array:
    """Return ``strains`` as they drive an ``arm``: themselves a beam, over the ``largest`` yekutieli's muscles."""
    return strains if arm.strained else np.clip(strains / largest, -1.0, 1.0)


def couple(
    network: Network,
    segments: int,
    duration: float,
    *,
    mode: str = "ideal",
    actuator: Actuator = PAPER,
    segment_length: float | None = None,
    voltage: float = LARGEST_VOLTAGE,
    start: ArrayLike | None = None,
    units: ArrayLike | None = None,
    slower: float = 1.0,
    reference: float | None = None,
    neurons_in_circuit: bool = False,
) -> Coupled:
    """Run ``network`` over ``duration`` [s] and transfer its outputs by ``mode`` to the strains of ``segments``.

    ``actuator`` is the strip that segments are cut from, each ``segment_length`` [m] (default: its free length over
    their number); ``voltage`` Vmax [V]; ``units`` (segments,) is the unit that drives each segment. ``slower``
    stretches the network's time constants. ``reference`` is A_ref, the output that gives Vmax (default: the amplitude
    of the rhythm itself). ``neurons_in_circuit`` puts the network into the strips' netlist, too: one transient of the
    whole chain. Raises InputError for values out of range, SolveError as ngspice does.
    """
    if mode not in MODES:
        raise wrong_choice("coupling", mode, MODES)
    if segments < 1:
        raise InputError(f"{segments} segments: give one or more")
    require_positive("voltage", voltage, "V")
    require_positive("duration", duration, "s")
    if not (np.isfinite(slower) and slower > 0):
        raise InputError(f"the rhythm cannot be {slower:g} times slower; give a number above zero")
    if reference is not None and not (np.isfinite(reference) and reference > 0):
        raise InputError(f"reference {reference:g} must be more than zero and finite: the output that gives Vmax")
    if neurons_in_circuit and mode == "ideal":
        raise InputError("ideal coupling has no circuit to put the neurons in; choose circuit or charge")
    if actuator.coupling is None:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]: it cannot move an arm")
    network = network.slowed(slower)
    known = rhythm_of(network, start)
    times = _times(network, known.period, duration)
    rhythm = run_network(network, times, start, known=known)
    of_segment = unit_of_segment(len(network.units), segments, units)
    outputs = rhythm.unit_outputs[:, of_segment]
    largest = lumped_strain(actuator, voltage)
    reference = reference or rhythm.amplitude or float(np.abs(outputs).max()) or 1.0
    shares = np.clip(outputs / reference, -1.0, 1.0)
    voltages = voltage * shares
    strip = segment_strip(actuator, segments, segment_length)
    if mode == "ideal":
        charges, strains, error = np.zeros_like(shares), largest * outputs / reference, 0.0
    elif neurons_in_circuit:
        found = with_neurons(strip, times, network, rhythm.states[0], of_segment, voltage, reference)
        charges, strains, error, outputs, voltages = found
    else:
        charges, strains, error = through_circuits(strip, times, voltages)
    if mode == "charge":
        strains = lagging(strip, charges, voltage, largest)
    scales = _scales(strip, mode, rhythm.period)
    return Coupled(mode, rhythm, times, outputs, voltages, charges, strains, largest, scales, error)


def lagging(strip: Actuator, charges: Array, voltage: float, largest: float) -> Array:
    """Return the strains of the ``charge`` mode: ``largest`` times ``charges`` [C] over their final value."""
    return largest * charges / (strip_charge(strip) * voltage)


def lumped_strain(actuator: Actuator, voltage: float) -> float:
    """Return eps_max = 3 d0 V/b: the free strain of a face that ``voltage`` [V] at the port gives in the end."""
    assert actuator.coupling is not None
    g = actuator.geometry
    return lumped_elements(actuator).steady(voltage) * g.thickness / g.load_distance**2


def strip_charge(actuator: Actuator) -> float:
    """Return the charge per volt at the terminals [C/V] that the ion path has in the end (near 0 V)."""
    port = lumped_elements(actuator).port
    return float(port.capacitance * port.inner_voltage(1e-6) / 1e-6)


def segment_strip(actuator: Actuator, segments: int, length: float | None = None) -> Actuator:
    """Return the piece of strip of one segment: R L/l, C l/L, time constants unchanged; ``length`` l [m]."""
    require_lump(actuator, "an arm's segment")
    piece = actuator.geometry.free_length / segments if length is None else length
    require_positive("segment length", piece, "m")
    geometry = replace(actuator.geometry, length=piece, free_length=piece, load_position=None)
    return replace(actuator, geometry=geometry, name=f"segment of {actuator.name}")


def _times(network: Network, period: float | None, duration: float) -> Array:
    """Return even times [s] to ``duration``, `_SAMPLES` in a period (without one, in the longer time constant)."""
    period = period or max(network.rise_time, network.adaptation_time)
    count = int(np.ceil(_SAMPLES * duration / period))
    if count > _MOST_SAMPLES:
        raise InputError(
            f"{duration:g} s are {duration / period:.3g} periods; at most {_MOST_SAMPLES // _SAMPLES} can be"
        )
    return np.linspace(0.0, duration, max(count, 20) + 1)


def unit_of_segment(count: int, segments: int, units: ArrayLike | None = None) -> NDArray[np.intp]:
    """Return the unit, of ``count``, that drives each segment (segments,): by default the nearest along the arm."""
    if units is None:
        return np.minimum((np.arange(segments) + 0.5) * count / segments, count - 1).astype(np.intp)
    given = np.asarray(units)
    if given.shape != (segments,) or not np.issubdtype(given.dtype, np.integer):
        raise InputError(f"units: give {segments} whole numbers, one a segment")
    wrong = given[(given < 0) | (given >= count)]
    if len(wrong):
        raise InputError(f"units name {int(wrong[0])}; the network has {count}, counted from 0")
    return given.astype(np.intp)


def _scales(strip: Actuator, mode: str, period: float | None) -> tuple[TimeScale, ...]:
    """Return the transfer from voltage to strain over its static value, at the rhythm's period and slower."""
    if period is None:
        return ()
    periods = period * np.array([1.0, 10.0, 100.0])
    ratio = np.ones(3) if mode == "ideal" else _transfer(strip, mode, 1 / periods[::-1])[::-1]
    return tuple(
        TimeScale(float(p), float(abs(r)), float(np.degrees(np.angle(r)))) for p, r in zip(periods, ratio, strict=True)
    )


def _transfer(strip: Actuator, mode: str, frequencies: Array) -> ComplexArray:
    """Return the transfer at ``frequencies`` [Hz], ascending (f,), over its static value, by the exact engine."""
    netlist = strip_netlist(strip, beam="static", band=(0.1 * frequencies[0], 10 * frequencies[-1]))
    found = spectrum(netlist, frequencies, engine="exact")
    if mode == "charge":
        return found.output("charge") / strip_charge(strip)
    g = strip.geometry
    return found.output("displacement") / (lumped_strain(strip, 1e-6) / 1e-6 * g.length**2 / g.thickness)
