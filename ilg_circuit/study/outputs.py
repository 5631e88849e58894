"""Outputs of a run: numbers derived from its waveforms, each with its unit and meaning.

Signs as in `simulation.response`: displacement and force are positive towards the anode and taken at L_F. "The motion"
is the displacement, or the force where the tip is clamped. NaN stands for a quantity that a scenario does not have (a
displacement without a coupling), and for times of a motion that ends at zero. Peaks and times are exact, not limited
to samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..simulation.waveforms import ANSWERS
from ..simulation.waveforms import WAVEFORMS as SIMULATED
from ..solve.panels import Panels
from .piecewise import PiecewiseLegendre

#: Relative distance from its final value within which a motion counts as settled.
SETTLING_BAND = 0.02

#: Waveforms that a study can keep -> SI unit.
WAVEFORMS = {waveform.name: waveform.unit for waveform in ANSWERS if waveform.compute is None}


@dataclass(frozen=True, eq=False)
class BatchWaveforms:
    """Waveforms of n scenarios on the same panels; ``drive`` (n, m, NODES) [V, A]; ``tip`` free or clamped.

    ``load_distance`` (n,) is L_F [m].
    """

    panels: Panels
    drive: Array
    curves: dict[str, PiecewiseLegendre]
    tip: str
    load_distance: Array

    def curve(self, name: str) -> PiecewiseLegendre:
        """Return the waveforms of that name; NaN where the scenarios do not have it."""
        return self.curves.get(name) or PiecewiseLegendre(self.panels, np.full(self.drive.shape, np.nan))

    @property
    def voltage(self) -> PiecewiseLegendre:
        """The voltage, which is the drive or the answer to a current."""
        return self.curves.get("voltage") or PiecewiseLegendre(self.panels, self.drive)

    @property
    def answer(self) -> PiecewiseLegendre:
        """The current that answers a voltage, or the voltage that answers a current."""
        return self.curves.get("voltage") or self.curve("current")

    @property
    def motion(self) -> PiecewiseLegendre:
        return self.curve("force" if self.tip == "clamped" else "displacement")


@dataclass(frozen=True)
class Output:
    """A number derived from a run; ``blocked``: from the same scenario with its tip clamped and without a load.

    ``on_request``: only if it is asked for.
    """

    name: str
    unit: str
    meaning: str
    compute: Callable[[BatchWaveforms], Array]
    blocked: bool = False
    on_request: bool = False

    def __reduce__(self) -> tuple[Callable[[str], Output], tuple[str]]:
        """Pickle an output by its name."""
        return _by_name, (self.name,)


def _by_name(name: str) -> Output:
    return OUTPUTS[name]


def _overshoot(runs: BatchWaveforms) -> Array:
    final = runs.motion.final
    beyond = runs.motion.extreme(np.where(final < 0, -1.0, 1.0))[0]
    ratio: Array = np.divide(beyond, final, out=np.full_like(final, np.nan), where=final != 0)
    return np.maximum(ratio - 1, 0.0)


def _of_waveform(name: str) -> list[Output]:
    unit, at = WAVEFORMS[name], f" {SIMULATED[name].place}".rstrip()
    return [
        Output(f"{name}_final", unit, f"{name}{at} at the end", lambda runs: runs.curve(name).final),
        Output(f"{name}_peak", unit, f"largest {name}{at}, with its sign", lambda runs: runs.curve(name).peak()[0]),
        Output(f"{name}_rms", unit, f"root mean square {name}{at}", lambda runs: runs.curve(name).rms()),
    ]


def _deflection(runs: BatchWaveforms) -> Array:
    return np.abs(runs.curve("displacement").peak()[0]) / runs.load_distance


def _settled(runs: BatchWaveforms) -> Array:
    return runs.motion.settled(SETTLING_BAND)


_ALL = [
    *_of_waveform("displacement"),
    Output("relative_deflection", "", "largest displacement over L_F; the model holds up to 0.2", _deflection),
    Output("time_of_peak", "s", "time at which the motion is largest", lambda runs: runs.motion.peak()[1]),
    Output("overshoot", "", "how far the motion exceeds its final value, relative to that value", _overshoot),
    Output(
        "time_of_90",
        "s",
        "time at which the motion first reaches 90 % of its final value",
        lambda runs: runs.motion.reached(0.9),
    ),
    Output(
        "settling_time",
        "s",
        f"time from which the motion stays within {100 * SETTLING_BAND:g} % of its final value",
        _settled,
    ),
    *_of_waveform("force"),
    Output("force_blocked", "N", "force at the end with L_F clamped", lambda runs: runs.curve("force").final, True),
    Output(
        "force_blocked_peak", "N", "largest force with L_F clamped", lambda runs: runs.curve("force").peak()[0], True
    ),
    Output("voltage_final", "V", "voltage at the end", lambda runs: runs.voltage.final, on_request=True),
    Output("voltage_peak", "V", "largest voltage, with its sign", lambda runs: runs.voltage.peak()[0], on_request=True),
    *_of_waveform("current"),
    *_of_waveform("charge"),
    Output("energy", "J", "energy delivered by the source", lambda r: r.answer.integral(r.drive)),
]

#: Every output by name.
OUTPUTS = {output.name: output for output in _ALL}
#: Outputs of a study that names none: all but those that need a second run with the tip clamped, and the voltage.
DEFAULT_OUTPUTS = tuple(output.name for output in _ALL if not (output.blocked or output.on_request))


def names_of(given: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return names, each once, from a sequence, or from a text with commas."""
    listed = given.split(",") if isinstance(given, str) else given or ()
    return tuple(dict.fromkeys(name.strip() for name in listed if name.strip()))


def choose_outputs(names: Iterable[str] | None = None) -> tuple[Output, ...]:
    """Return the outputs of those names, each once; by default all of `DEFAULT_OUTPUTS`.

    Raises InputError that lists the known names.
    """
    chosen = tuple(dict.fromkeys(DEFAULT_OUTPUTS if names is None else names))
    for name in chosen:
        if name not in OUTPUTS:
            raise InputError(f"unknown output '{name[:40]}'; choose from {', '.join(OUTPUTS)}")
    if not chosen:
        raise InputError(f"no output is asked for; choose from {', '.join(OUTPUTS)}")
    return tuple(OUTPUTS[name] for name in chosen)
