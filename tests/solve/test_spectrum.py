"""AC analysis by ngspice, the rational function of the state space, and EC (17) solved by hand must say the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from every_model import MODELS, PortEquations, port_of, strip_of, strongly_coupled
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from strategies import log_floats
from strategies import strips as random_strips

from ilg_circuit.circuit import Element, Load, Netlist, Output, electrical_netlist, port_netlist, strip_netlist
from ilg_circuit.circuit.strip import sensor_netlist
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.solve.spectrum import spectrum
from ilg_circuit.strip.actuator import PAPER, Actuator, Mounting
from ilg_circuit.strip.elements import hanging_stiffness, lumped_elements
from ilg_circuit.strip.port import Port

Complex = NDArray[np.complex128]

#: Six decades about the strips' time constants; ladders reach a little further.
F = np.geomspace(1e-3, 1e3, 13) / (2 * np.pi)
S = 2j * np.pi * F
BAND = (1e-4, 200.0)
ENGINES = ("ngspice", "exact")

LOADS = {
    "mass": Load(mass=1e-4),
    "spring": Load(stiffness=1e-4),
    "dashpot": Load(damping=1e-4),
    "all": Load(mass=5e-5, stiffness=2e-4, damping=3e-5),
}


def tolerance(strip: Actuator) -> float:
    """Relative. The conductances of a ladder, or of any strip with any load, lie decades apart: rounding shows."""
    if strip.name == "random":
        return 1e-6
    return 1e-9 if lumped_elements(strip).port.ladder is None else 1e-8


def assert_driven(strip: Actuator, tip: str, beam: str, load: Load | None = None) -> None:
    netlist = strip_netlist(strip, tip=tip, beam=beam, load=load)
    expected = PortEquations(strip, lumped_elements(strip).port, S).driven(tip, beam, load or Load())
    for engine in ENGINES:
        found = spectrum(netlist, F, engine=engine)
        for name in ("current", "charge", "displacement", "force"):
            allowed = tolerance(strip) * np.abs(expected[name])
            allowed = allowed + expected.get(
                {"displacement": "rounding", "force": "rounding of force"}.get(name, ""), 0.0
            )
            excess = float((np.abs(found.output(name) - expected[name]) / np.maximum(allowed, 1e-300)).max())
            assert excess <= 1, (engine, name, excess)


def assert_moved(strip: Actuator, terminals: str) -> None:
    netlist = sensor_netlist(strip, terminals=terminals)
    expected = PortEquations(strip, lumped_elements(strip).port, S).moved(terminals)
    for engine in ENGINES:
        found = spectrum(netlist, F, engine=engine)
        for name, values in expected.items():
            assert found.output(name) == pytest.approx(values, rel=tolerance(strip), abs=0), (engine, name)
        assert found.output("displacement") == pytest.approx(np.ones(len(F)), rel=1e-12)


# -- every netlist -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("electrodes", "stiff"), [(0.0, True), (5.0, False)], ids=["stiff", "electrodes"])
@pytest.mark.parametrize("model", MODELS)
def test_every_model_is_ec_17(model: str, electrodes: float, stiff: bool) -> None:
    strip = strip_of(model, electrodes, band=BAND)
    if stiff:
        strip = strongly_coupled(strip)
    for tip in ("free", "clamped"):
        for beam in ("dynamic", "static"):
            assert_driven(strip, tip, beam)
    for terminals in ("open", "short"):
        assert_moved(strip, terminals)


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
@pytest.mark.parametrize("model", ["rc", "rc2+growing+sinh", "warburg", "cpe+sinh"])
def test_every_load_is_ec_17(model: str, load: Load) -> None:
    for strip in (strip_of(model, 5.0, band=BAND), strongly_coupled(strip_of(model, band=BAND))):
        assert_driven(strip, "free", "dynamic", load)


@pytest.mark.parametrize("which", ["load inside", "undamped"])
def test_other_strips_are_ec_17(strips: dict[str, Actuator], which: str) -> None:
    for load in (None, LOADS["all"]):
        assert_driven(strips[which], "free", "dynamic", load)
    assert_driven(strips[which], "clamped", "dynamic")
    assert_moved(strips[which], "open")


@settings(max_examples=15)
@given(
    random_strips(most_branches=3),
    st.one_of(st.none(), st.builds(Load, log_floats(1e-6, 1e-3), log_floats(1e-6, 1e-3), log_floats(1e-6, 1e-3))),
)
def test_random_strips_are_ec_17(strip: Actuator, load: Load | None) -> None:
    assert_driven(strip, "free", "dynamic", load)
    assert_driven(strip, "clamped", "dynamic")
    for terminals in ("open", "short"):
        assert_moved(strip, terminals)


def test_a_given_bending_stiffness_stands_for_the_modulus() -> None:
    """K = 3 EI/L_F^3, at a load inside the free length as well."""
    stiff = replace(PAPER.material, bending_stiffness=2e-8)
    for position in (None, 18e-3):
        strip = replace(PAPER, material=stiff, geometry=replace(PAPER.geometry, load_position=position))
        distance = position or PAPER.geometry.free_length
        assert lumped_elements(strip).stiffness == pytest.approx(3 * 2e-8 / distance**3, rel=1e-14)
        assert_driven(strip, "clamped", "dynamic")
        assert_driven(strip, "free", "dynamic", LOADS["all"])
        assert_moved(strip, "short")


# -- laws of the whole port --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("model", MODELS)
def test_the_port_is_reciprocal(model: str, electrodes: float) -> None:
    """Current into shorted terminals per tip velocity is clamped force per volt."""
    strip = strongly_coupled(strip_of(model, electrodes, band=BAND))
    forward = spectrum(strip_netlist(strip, tip="clamped"), F).output("force")
    backward = spectrum(sensor_netlist(strip, terminals="short"), F).output("current") / S
    assert backward == pytest.approx(forward, rel=tolerance(strip), abs=0)


@pytest.mark.parametrize("model", MODELS)
def test_open_voltage_is_short_current_through_the_clamped_port(model: str) -> None:
    """Thevenin: both are answers of one source behind the impedance that the clamped strip shows at its terminals."""
    strip = strongly_coupled(strip_of(model, 5.0, band=BAND))
    voltage = spectrum(sensor_netlist(strip, terminals="open"), F).output("voltage")
    current = spectrum(sensor_netlist(strip, terminals="short"), F).output("current")
    clamped = 1 / spectrum(strip_netlist(strip, tip="clamped"), F).output("current")
    assert voltage == pytest.approx(-current * clamped, rel=tolerance(strip), abs=0)


def test_a_stiff_spring_clamps_and_a_soft_one_frees() -> None:
    """Each by first order: what is missing goes with the ratio of the stiffnesses."""
    stiffness = lumped_elements(PAPER).stiffness
    clamped = spectrum(strip_netlist(PAPER, tip="clamped"), F).output("force")
    free = spectrum(strip_netlist(PAPER), F).output("displacement")
    slow = F < 0.02
    for ratio in (1e2, 1e4, 1e6):
        hard = spectrum(strip_netlist(PAPER, load=Load(stiffness=ratio * stiffness)), F).output("force")
        assert np.abs(hard[slow] / clamped[slow] - 1).max() < 1.1 / ratio
        soft = spectrum(strip_netlist(PAPER, load=Load(stiffness=stiffness / ratio)), F).output("displacement")
        assert 0 < np.abs(soft[slow] / free[slow] - 1).max() < 1.1 / ratio


@pytest.mark.parametrize("load_mass", [0.0, 1e-5, 3e-4, 1e-2])
def test_a_mass_lowers_the_resonance(load_mass: float) -> None:
    """The tip's path against what the strip wants is K/(K - (m + M) w^2 + ...): a quarter turn at sqrt(K/(m + M))."""
    strip = replace(PAPER, material=replace(PAPER.material, beam_damping_ratio=0.01))
    lumped = lumped_elements(strip)
    f = np.sqrt(lumped.stiffness / (lumped.mass + load_mass)) / (2 * np.pi) * np.array([0.99, 1.0, 1.01])
    load = Load(mass=load_mass) if load_mass else None
    moved = spectrum(strip_netlist(strip, load=load), f).output("displacement")
    wanted = spectrum(strip_netlist(strip, beam="static"), f).output("displacement")
    below, at, above = np.degrees(np.angle(moved / wanted))
    assert at == pytest.approx(-90, abs=1e-4)
    assert below > at + 10
    assert above < at - 10
    gain = abs(moved / wanted)[1]
    assert gain == pytest.approx(np.sqrt(lumped.stiffness * (lumped.mass + load_mass)) / lumped.damping, rel=1e-6)


def test_hanging_gravity_is_a_spring_that_exerts_nothing() -> None:
    strip = replace(PAPER, material=replace(PAPER.material, youngs_modulus=2e6))
    hanging = replace(strip, mounting=Mounting("hanging"))
    spring = Load(stiffness=hanging_stiffness(strip))
    expected = spectrum(strip_netlist(strip, load=spring), F)
    found = spectrum(strip_netlist(hanging), F)
    assert found.output("displacement") == pytest.approx(expected.output("displacement"), rel=1e-7)
    assert not found.output("force").any()
    both = spectrum(strip_netlist(hanging, load=spring), F)
    doubled = spectrum(strip_netlist(strip, load=Load(stiffness=2 * spring.stiffness)), F)
    assert both.output("displacement") == pytest.approx(doubled.output("displacement"), rel=1e-7)
    assert both.output("force") == pytest.approx(doubled.output("force") / 2, rel=1e-7)
    lying = spectrum(strip_netlist(replace(strip, mounting=Mounting("horizontal"))), F)
    assert lying.values == pytest.approx(spectrum(strip_netlist(strip), F).values, abs=0)


# -- about a bias ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bias", [0.5, -2.0, 4.0])
@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("model", [m for m in MODELS if "+" in m])
def test_a_biased_port_is_its_linearisation(model: str, electrodes: float, bias: float) -> None:
    """ngspice finds its own operating point behind Re; the laws' slopes there are written out here."""
    port = port_of(model, electrodes, band=BAND)
    found = 1 / spectrum(port_netlist(port), F, bias=bias).output("current")
    inner = bisected_inner_voltage(port.dc_resistance, port.emission_voltage, electrodes, bias)
    assert port.inner_voltage(bias) == pytest.approx(inner, rel=1e-12)
    slope = 1 / port.dc_resistance
    if port.emission_voltage:
        slope *= np.cosh(inner / port.emission_voltage)
    if port.ladder is None:
        grown = [(r, c * capacitance_at(port, inner)) for r, c in port.branches]
        ion = 1 / sum(1 / (r + 1 / (c * S)) for r, c in grown)
    else:
        ion = port.ion_impedance(S)
    expected = port.inductance * S + electrodes + 1 / (slope + 1 / ion)
    assert port.impedance(S, bias) == pytest.approx(expected, rel=1e-14, abs=0)
    # ngspice's own slope of the steric law, which has differences of large numbers, is good to eight digits
    assert found == pytest.approx(expected, rel=1e-8 if port.packing_fraction else 1e-9, abs=0)


def capacitance_at(port: Port, voltage: float) -> float:
    """The slope of the charge at a voltage, relative to that at 0 V, of every law of charge."""
    if port.saturation_voltage is not None:
        return float(1 / np.cosh(voltage / port.saturation_voltage) ** 2)
    if port.packing_fraction is not None:
        import mpmath

        nu, thermal = port.packing_fraction, mpmath.mpf(1.380649e-23) * 298.15 / 1.602176634e-19

        def charge(v: float) -> object:  # of two double layers, each with half of the voltage
            return mpmath.sqrt(2 / nu * mpmath.log(1 + 2 * nu * mpmath.sinh(v / (4 * thermal)) ** 2))

        with mpmath.workdps(40):
            return float(mpmath.diff(charge, abs(voltage)) * 2 * thermal)
    return 1 + port.capacitance_slope * abs(voltage)


def bisected_inner_voltage(dc: float, emission: float | None, electrodes: float, bias: float) -> float:
    low, high = sorted((0.0, bias))
    for _ in range(200):
        middle = (low + high) / 2
        current = middle / dc if emission is None else emission / dc * np.sinh(middle / emission)
        low, high = (low, middle) if middle + electrodes * current > bias else (middle, high)
    return (low + high) / 2


def test_a_whole_strip_can_be_biased() -> None:
    """The bias is on the ions and the electron path; the coupling is linear, so the displacement per volt stays."""
    strip = strip_of("rc2+growing+sinh", band=BAND)
    netlist = strip_netlist(strip)
    rest, biased = spectrum(netlist, F), spectrum(netlist, F, bias=3.0)
    exact = spectrum(netlist, F, bias=3.0, inner_bias=3.0, engine="exact")
    assert biased.values == pytest.approx(exact.values, rel=1e-8, abs=1e-15)
    assert biased.output("displacement") == pytest.approx(rest.output("displacement"), rel=1e-8)
    assert (np.abs(biased.output("current")) > 1.2 * np.abs(rest.output("current")))[0]


# -- what cannot be answered -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("frequency", [[], [0.0], [-1.0], [1.0, np.nan], [np.inf], [[1.0]], 1.0])
def test_frequencies_that_are_none(engine: str, frequency: object) -> None:
    with pytest.raises(InputError, match="at least one frequency, all positive and finite"):
        spectrum(electrical_netlist(600.0, ((20.0, 0.3),)), frequency, engine=engine)  # type: ignore[arg-type]


def test_an_unknown_engine() -> None:
    with pytest.raises(InputError, match="engine is 'xyce'; choose ngspice or exact"):
        spectrum(electrical_netlist(600.0, ((20.0, 0.3),)), [1.0], engine="xyce")


def test_an_operating_point_that_there_is_not() -> None:
    with pytest.raises(SolveError, match=r"ngspice did not run the small-signal analysis: .*out of range for sinh"):
        spectrum(port_netlist(port_of("rc+sinh")), [1.0], bias=1e3)
    # and the next question is answered as if nothing had been
    test_an_open_part_keeps_open()


def test_an_open_part_keeps_open() -> None:
    """What stands in the air without direct current must look so at the lowest frequency too."""
    elements = (
        Element("Vdrive", ("in", "0"), 0.0),
        Element("C1", ("in", "a"), 1e-6),
        Element("R1", ("a", "b"), 1e6),
        Element("C2", ("b", "0"), 1e-6),
    )
    net = Netlist("divider", elements, (Output("b", "V", (("v(b)", 1.0),)),))
    f = np.array([1e-3, 1.0, 1e3])
    expected = 1 / (2 + 2j * np.pi * f)
    for engine in ENGINES:
        assert spectrum(net, f, engine=engine).output("b") == pytest.approx(expected, rel=1e-10)


@given(log_floats(1e-9, 1e3), log_floats(1e-6, 1e6))
def test_the_inner_voltage_is_found_however_steep_the_sinh_law(emission: float, electrodes: float) -> None:
    port = Port(100.0, ((10.0, 0.1),), electrode_resistance=electrodes, emission_voltage=emission)
    inner = port.inner_voltage(3.0)
    assert 0 <= inner <= 3.0 * (1 + 1e-8)
