"""The coupling in an exported library: the expressions of its filters' values, of any kind of coupling."""

from __future__ import annotations

from ..strip.actuator import Coupling
from ..strip.couplings import CouplingLaw, RelaxingCoupling
from ..strip.models.model import LibraryText
from ..strip.port import Port
from .coupling import Transducer
from .load import FORCE_SCALE
from .relaxing import Relaxing


def derived_of_coupling(coupling: CouplingLaw, ions: LibraryText) -> dict[str, str]:
    """Name -> expression of the values that a coupling's elements share."""
    if not isinstance(coupling, Coupling):
        return {"cref": "+ ".join(f"({c})" for c in stored(ions))}
    return {
        "lfilter": "1/(coupling_natural_frequency*coupling_natural_frequency)",
        "rfilter": "2*coupling_damping_ratio/coupling_natural_frequency",
        # of d(s) v: from the filter's capacitor, and from its current
        "settled": "bending*coupling_gain*coupling_zero*lfilter",
        "passing": "bending*coupling_gain*lfilter/rfilter",
    }


def filter_values(wired: Transducer, ions: LibraryText) -> dict[str, str]:
    """Return the values of the coupling's filters, and of the sources that reflect, by the elements' names."""
    if not isinstance(wired, Relaxing):
        values = {f"{kind}{name}": f"{kind.lower()}filter" for name in "ds" for kind in "RL"}
        return values | {"Gu1a": f"{FORCE_SCALE!r}*bending*coupling_gain", "Gu1b": f"{FORCE_SCALE!r}*settled/rfilter"}
    modes = list(enumerate(wired.lumped.relaxations, 1))
    values = {f"Rz{name}{k}": mode.time_text for name in "ds" for k, mode in modes}
    if not wired.coupling.follows_charge:
        gain = f"{FORCE_SCALE!r}*bending"
        return values | {f"Gu1{k}": f"{gain}*{mode.gain_text}/({mode.time_text})" for k, mode in modes}
    metered = wired.lumped.port.charge_law is not None
    values |= {f"Exd{k}": f"{'1' if metered else f'({c})'}/cref" for k, c in enumerate(stored(ions))}
    return values | summed("copy", f"{FORCE_SCALE!r}/cref", gains(wired))


def gains(wired: Transducer) -> list[str]:
    """Return the free displacement's gains [m], in the order of `Transducer.displacement`."""
    if isinstance(wired, Relaxing):
        return [f"bending*{gain}" for gain in wired.gains()]
    return ["settled", "passing", "-passing"]


def summed(node: str, factor: str, terms: list[str]) -> dict[str, str]:
    """Return the sources in series at ``node``: ``factor`` times each of ``terms``."""
    texts = (f"-{factor}*{term[1:]}" if term.startswith("-") else f"{factor}*{term}" for term in terms)
    return {f"E{node}{k}": text for k, text in enumerate(texts)}


def stored(ions: LibraryText) -> list[str]:
    """Return the capacitances that keep the ion path's charge."""
    return [ions.capacitance] if ions.capacitance else [c for _, c in ions.sections]


def fastest(coupling: CouplingLaw, port: Port) -> float:
    """Return a time [s] beside which a beam without mass is to be nothing: the fastest of the coupling."""
    if isinstance(coupling, Coupling):
        return coupling.zero / (coupling.natural_frequency * (coupling.natural_frequency + coupling.zero))
    assert isinstance(coupling, RelaxingCoupling)
    if coupling.relaxations:
        return min(mode.time for mode in coupling.relaxations)
    if coupling.fractional_time:
        return coupling.fractional_time
    ladder, (resistance, capacitance) = port.ladder, (port.branches or ((0.0, 0.0),))[0]
    if ladder is not None:
        resistance, capacitance = port.series_resistance + ladder.resistance, ladder.capacitance
    return resistance * capacitance


def fastest_text(coupling: CouplingLaw, ions: LibraryText) -> str:
    """Return `fastest` as an expression of a library."""
    if isinstance(coupling, Coupling):
        wn = "coupling_natural_frequency"
        return f"coupling_zero/({wn}*({wn}+coupling_zero))"
    assert isinstance(coupling, RelaxingCoupling)
    if coupling.relaxations:
        return min(coupling.relaxations, key=lambda mode: mode.time).time_text
    if coupling.fractional_time:
        return "coupling_fractional_time"
    return f"({ions.resistance or ions.sections[0][0]})*({stored(ions)[0]})"
