"""The classes of what the front door returns, for annotations and for ``help``.

    import ilg_circuit as ilg

    def peak(run: ilg.results.Response) -> float: ...

    help(ilg.results.Identification)

All results share the methods of `Result`: ``summary``, ``to_dataframe``, ``to_xarray``, ``to_dict``, ``plot``,
``figure`` and ``save``.

===================  ================================================================================================
`Actuator`           a strip, from `ilg.load`, or ``fit.actuator``
`Specimen`           a strip that has no circuit yet, from `ilg.new_strip`
`Response`           waveforms of a run, from `ilg.simulate`
`Shape`              centre line of a strip over time, from `ilg.shape`
`Bode`               displacement, current and force over frequency, from `ilg.bode`
`BodeOfRecords`      the same from records, with bands, from `ilg.bode_of`
`Impedance`          impedance over frequency, from `ilg.impedance`
`Sensed`             voltage or current of a strip that is moved, from `ilg.sense`
`Record`             measured waveforms, from `ilg.read`
`Spectrum`           a measured impedance, from `ilg.read`
`LoadTest`           measured stress over stretch, from `ilg.read`
`Identification`     the fit of a strip, from `ilg.identify`
`ShapeFit`           the resistance along a strip, from `ilg.identify_shape`
`SheetsFit`          the same from spectra, from `ilg.identify_sheets`
`SensingFit`         the law by which a strip senses, from `ilg.identify_sensing`
`Estimate`           a fitted parameter with its error and interval, as in ``fit["capacitance"]``
`Batch`              fits of many files, from `ilg.identify_each`
`FileFit`            one row of a `Batch`
`FitResult`          the fit of a curve, from `ilg.fit_curve`
`Characterisation`   a hyperelastic material, from `ilg.ogden`
`SweepResult`        the outputs of many designs, from `ilg.sweep`
`DesignReport`       a design, or a front of designs, from `ilg.design` and `ilg.pareto`
`Design`             the design itself, ``report.design``
`Front`              the trade-off between objectives, ``report.front``
`Closed`             a closed position loop over time, from `ilg.close_loop`
`Tracked`            the voltage for a path, from `ilg.track`
`TrackedShape`       the voltages of segments for a path of the shape, from `ilg.track`
`Learned`            errors over repeated trials, from `ilg.learn`
`Tuned`              a position controller and its margins, from `ilg.tune`
`Adaptive`           a controller that identifies its strip, from `ilg.adaptive`
`RhythmRun`          the outputs of neurons, from `ilg.cpg`
`RhythmSweep`        rhythms over the neurons' constants, from `ilg.cpg`
`ReflexRun`          neurons that feel the strip they drive, from `ilg.reflex`
`ReflexSweep`        their rhythm over the gain, from `ilg.reflex`
`Entrainment`        the range to which their rhythm locks, from `ilg.reflex`
`ArmResult`          the motion of a soft arm, from `ilg.arm`
`Motion`             positions of an arm over time, ``moved.motion``
`SpiceText`          a SPICE deck or subcircuit, from `ilg.netlist` and `ilg.library`
`IonPath`            an electrical model, from `ilg.register_model`
`Finding`            one warning of a result, with a code and numbers
===================  ================================================================================================
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..arms.motion import Motion
    from ..arms.run import ArmResult
    from ..circuit.text import SpiceText
    from ..control.adaptive import Adaptive
    from ..control.close import Closed
    from ..control.learn import Learned
    from ..control.track import Tracked
    from ..control.tracked_shape import TrackedShape
    from ..control.tune import Tuned
    from ..findings import Finding
    from ..fit.estimate import Estimate
    from ..fit.result import FitResult
    from ..hyperelastic.characterisation import Characterisation
    from ..identification.batch import Batch, FileFit
    from ..identification.frequency_response import BodeOfRecords
    from ..identification.identification import Identification
    from ..identification.sensing import SensingFit
    from ..identification.shape import ShapeFit
    from ..identification.sheets import SheetsFit
    from ..measurements.load_test import LoadTest
    from ..measurements.record import Record
    from ..measurements.spectrum import Spectrum
    from ..oscillators.run import RhythmRun
    from ..oscillators.sweep import RhythmSweep
    from ..result import Result
    from ..simulation.bode import Bode
    from ..simulation.impedance import Impedance
    from ..simulation.response import Response
    from ..simulation.sensing import Sensed
    from ..simulation.shape import Shape
    from ..strip.actuator import Actuator
    from ..strip.models import IonPath
    from ..strip.specimen import Specimen
    from ..study.design import DesignReport
    from ..study.pareto import Front
    from ..study.problem import Design
    from ..study.sweep import SweepResult

__all__ = [
    "Actuator",
    "Adaptive",
    "ArmResult",
    "Batch",
    "Bode",
    "BodeOfRecords",
    "Characterisation",
    "Closed",
    "Design",
    "DesignReport",
    "Estimate",
    "FileFit",
    "Finding",
    "FitResult",
    "Front",
    "Identification",
    "Impedance",
    "IonPath",
    "Learned",
    "LoadTest",
    "Motion",
    "Record",
    "Response",
    "Result",
    "RhythmRun",
    "RhythmSweep",
    "Sensed",
    "SensingFit",
    "Shape",
    "ShapeFit",
    "SheetsFit",
    "Specimen",
    "Spectrum",
    "SpiceText",
    "SweepResult",
    "Tracked",
    "TrackedShape",
    "Tuned",
]

_PLACES = {
    "arms.motion": ("Motion",),
    "arms.run": ("ArmResult",),
    "circuit.text": ("SpiceText",),
    "control.adaptive": ("Adaptive",),
    "control.close": ("Closed",),
    "control.learn": ("Learned",),
    "control.track": ("Tracked",),
    "control.tracked_shape": ("TrackedShape",),
    "control.tune": ("Tuned",),
    "findings": ("Finding",),
    "fit.estimate": ("Estimate",),
    "fit.result": ("FitResult",),
    "hyperelastic.characterisation": ("Characterisation",),
    "identification.batch": (
        "Batch",
        "FileFit",
    ),
    "identification.frequency_response": ("BodeOfRecords",),
    "identification.identification": ("Identification",),
    "identification.sensing": ("SensingFit",),
    "identification.shape": ("ShapeFit",),
    "identification.sheets": ("SheetsFit",),
    "measurements.load_test": ("LoadTest",),
    "measurements.record": ("Record",),
    "measurements.spectrum": ("Spectrum",),
    "oscillators.run": ("RhythmRun",),
    "oscillators.sweep": ("RhythmSweep",),
    "result": ("Result",),
    "simulation.bode": ("Bode",),
    "simulation.impedance": ("Impedance",),
    "simulation.response": ("Response",),
    "simulation.sensing": ("Sensed",),
    "simulation.shape": ("Shape",),
    "strip.actuator": ("Actuator",),
    "strip.models": ("IonPath",),
    "strip.specimen": ("Specimen",),
    "study.design": ("DesignReport",),
    "study.pareto": ("Front",),
    "study.problem": ("Design",),
    "study.sweep": ("SweepResult",),
}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        for place, names in _PLACES.items():
            if name in names:
                found = globals()[name] = getattr(import_module(f"ilg_circuit.{place}"), name)
                return found
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
