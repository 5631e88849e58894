"""From an ionic-liquid-gel strip's geometry and measurements to a solved, checked circuit.

    import ilg_circuit as ilg

    strip = ilg.load("paper")                                   # or a TOML file, or new_strip(length=..., ...)
    run = ilg.simulate(strip, "square:-2V..2V,30s", "300 s")    # impedance, sense, sweep, design, netlist, kit
    fit = ilg.identify("step.csv", strip)                       # identify_each, read, ogden, fit_curve

Every result prints its summary and has ``.summary()``, ``.to_dataframe()``, ``.to_xarray()``, ``.to_dict()``,
``.plot(ax=ax)`` and ``.save("x.csv")`` (also .json, .png, .html and, of waveforms, .nc); fits have ``.warnings``, and
``fit["capacitance"]`` has ``.value``, ``.stderr`` and ``.interval``; ``fit.actuator`` is the fitted strip, which has
``.with_(thickness="0.4 mm")`` and ``.save("strip.toml")``. The classes of results are in ``ilg.results``, for
annotations and ``help(ilg.results.Response)``.

Drives are texts such as step:4V, square:-2V..2V,30s (30 s is the period), sine:2V,0.1Hz, triangle:2V,30s, ramp:10mV/s,
file:drive.csv (``help(ilg.simulate)`` lists all forms), or (times, values). Quantities are SI numbers or texts with
units, such as "4 V". ``help(ilg.identify)`` lists the electrical models and their parameters, ``help(ilg.sweep)`` the
outputs of a run.

Names are imported when they are first used, so that the import itself takes no time.
"""

from importlib import import_module

TYPE_CHECKING = False  # in place of `typing.TYPE_CHECKING`: importing typing would take most of the time

if TYPE_CHECKING:
    from .errors import IlgError, IlgWarning, InputError, SolveError
    from .fit.curve import fit_curve
    from .front import results
    from .front.arms import arm
    from .front.bode import bode, bode_of
    from .front.circuits import kit, library, netlist, subcircuit
    from .front.control import close_loop, to_control, track
    from .front.data import read
    from .front.each import identify_each
    from .front.fits import identify, ogden
    from .front.given import load
    from .front.learning import learn
    from .front.models import register_model
    from .front.pages import page
    from .front.reflexes import reflex
    from .front.runs import impedance, sense, simulate
    from .front.sensing import identify_sensing
    from .front.shapes import identify_shape, shape
    from .front.sheets import identify_sheets
    from .front.strips import new_strip
    from .front.studies import pareto
    from .front.tuning import adaptive, tune
    from .oscillators.run import cpg
    from .strip.actuator import PAPER
    from .study.design import design
    from .study.sweep import sweep
    from .window.serve import app

__version__ = "0.2.0"

__all__ = [
    "PAPER",
    "IlgError",
    "IlgWarning",
    "InputError",
    "SolveError",
    "adaptive",
    "app",
    "arm",
    "bode",
    "bode_of",
    "close_loop",
    "cpg",
    "design",
    "fit_curve",
    "identify",
    "identify_each",
    "identify_sensing",
    "identify_shape",
    "identify_sheets",
    "impedance",
    "kit",
    "learn",
    "library",
    "load",
    "netlist",
    "new_strip",
    "ogden",
    "page",
    "pareto",
    "read",
    "reflex",
    "register_model",
    "results",
    "sense",
    "shape",
    "simulate",
    "subcircuit",
    "sweep",
    "to_control",
    "track",
    "tune",
]

_PLACES = {
    "errors": ("IlgError", "IlgWarning", "InputError", "SolveError"),
    "fit.curve": ("fit_curve",),
    "front.arms": ("arm",),
    "front.bode": ("bode", "bode_of"),
    "front.circuits": ("kit", "library", "netlist", "subcircuit"),
    "front.control": ("close_loop", "to_control", "track"),
    "front.data": ("read",),
    "front.each": ("identify_each",),
    "front.fits": ("identify", "ogden"),
    "front.given": ("load",),
    "front.learning": ("learn",),
    "front.models": ("register_model",),
    "front.pages": ("page",),
    "front.reflexes": ("reflex",),
    "front.runs": ("impedance", "sense", "simulate"),
    "front.sensing": ("identify_sensing",),
    "front.shapes": ("identify_shape", "shape"),
    "front.sheets": ("identify_sheets",),
    "front.strips": ("new_strip",),
    "front.studies": ("pareto",),
    "front.tuning": ("adaptive", "tune"),
    "oscillators.run": ("cpg",),
    "strip.actuator": ("PAPER",),
    "study.design": ("design",),
    "study.sweep": ("sweep",),
    "window.serve": ("app",),
}

if not TYPE_CHECKING:

    def __getattr__(name):
        if name == "results":
            return import_module(f"{__name__}.front.results")
        for place, names in _PLACES.items():
            if name in names:
                with import_module(f"{__name__}.extras").whole():
                    found = globals()[name] = getattr(import_module(f"{__name__}.{place}"), name)
                return found
        results = import_module(f"{__name__}.front.results")
        hint = f"; it is {__name__}.results.{name}" if name in results.__all__ else ""
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'{hint}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
