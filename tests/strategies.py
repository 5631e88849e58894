"""Hypothesis strategies: random actuators, within bounds that a laboratory could meet or as wild as a file may be."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import strategies as st

from ilg_circuit.strip.actuator import BEAMS, ORIENTATIONS, Actuator, Coupling, Geometry, IonBranch, Material, Mounting
from ilg_circuit.units import PLAUSIBLE


def log_floats(low: float, high: float) -> st.SearchStrategy[float]:
    """Floats spread evenly over the decades from ``low`` to ``high``."""
    from math import log10

    return st.floats(log10(low), log10(high)).map(lambda e: min(max(10.0**e, low), high))


def branches(low: float = 0.3, high: float = 3.0) -> st.SearchStrategy[IonBranch]:
    """Ionic branches whose resistivity and permittivity are the paper's times ``low`` to ``high``."""
    return st.builds(IonBranch, log_floats(6.8 * low, 6.8 * high), log_floats(low, high))


@st.composite
def strips(draw: st.DrawFn, *, most_branches: int = 2) -> Actuator:
    """Strips of a laboratory: every size and constant within a factor of a few of the paper's."""
    length = draw(log_floats(10e-3, 80e-3))
    free = length * draw(st.floats(0.5, 1.0))
    geometry = Geometry(
        length=length,
        free_length=free,
        width=draw(log_floats(1e-3, 20e-3)),
        thickness=draw(log_floats(0.1e-3, 2e-3)),
        load_position=draw(st.one_of(st.none(), st.floats(0.4, 1.0).map(lambda part: part * free))),
    )
    first = draw(branches())
    electrode = draw(st.sampled_from([0.0, 1e-6]))
    material = Material(
        dc_resistivity=draw(log_floats(20.0, 2000.0)),
        dynamic_resistivity=first.dynamic_resistivity,
        permittivity=first.permittivity,
        youngs_modulus=draw(log_floats(1e3, 1e6)),
        density=draw(log_floats(800.0, 3000.0)),
        beam_damping_ratio=draw(st.floats(0.05, 1.5)),
        electrode_resistivity_1=draw(log_floats(10.0, 1000.0)) if electrode else 0.0,
        electrode_thickness_1=electrode,
        further_branches=tuple(draw(st.lists(branches(0.03, 30.0), max_size=most_branches - 1))),
    )
    coupling = Coupling(
        gain=draw(log_floats(1e-10, 1e-8)),
        zero=draw(log_floats(0.02, 2.0)),
        damping_ratio=draw(log_floats(0.1, 3.0)),
        natural_frequency=draw(log_floats(0.01, 1.0)),
    )
    return Actuator(geometry, material, coupling, name="random")


#: Sizes that are allowed in every unit.
_LEAST = max(low for unit, (low, _) in PLAUSIBLE.items() if unit[:1] != "-")
_ANY_POSITIVE = st.floats(min_value=_LEAST, max_value=1e4)
_ANY_NAME = st.text(max_size=30)


@st.composite
def wild_actuators(draw: st.DrawFn) -> Actuator:
    """Any actuator that can be written down, sensible or not: what a file must carry without loss."""
    length = draw(_ANY_POSITIVE)
    free = draw(st.floats(min_value=_LEAST, max_value=length))
    load = draw(st.one_of(st.none(), st.floats(min_value=_LEAST, max_value=free)))
    geometry = Geometry(length, free, draw(_ANY_POSITIVE), draw(_ANY_POSITIVE), load)
    zero_or_more = st.one_of(st.just(0.0), _ANY_POSITIVE)
    material = Material(
        *(draw(_ANY_POSITIVE) for _ in range(5)),
        *(draw(zero_or_more) for _ in range(5)),
        further_branches=tuple(draw(st.lists(st.builds(IonBranch, _ANY_POSITIVE, _ANY_POSITIVE), max_size=3))),
    )
    beams = st.sampled_from([None, *BEAMS])
    coupling = draw(st.one_of(st.none(), st.builds(Coupling, *([_ANY_POSITIVE] * 4), beam=beams)))
    mounting = Mounting(draw(st.sampled_from(ORIENTATIONS)))
    return replace(Actuator(geometry, material, coupling, mounting), name=draw(_ANY_NAME))
