"""The strip's circuit against the port equations EC (17), solved by hand at every frequency."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import brentq
from strategies import log_floats
from strategies import strips as random_strips

from ilg_circuit.circuit import Load, Netlist, electrical_netlist, strip_netlist
from ilg_circuit.errors import InputError
from ilg_circuit.solve.state_space import state_space
from ilg_circuit.strip.actuator import PAPER, Actuator, Mounting
from ilg_circuit.strip.elements import hanging_stiffness, lumped_elements

Complex = NDArray[np.complex128]

#: Six decades of angular frequency about the strips' time constants.
S = 1j * np.geomspace(1e-3, 1e3, 49)

LOADS = {
    "none": Load(),
    "mass": Load(mass=1e-4),
    "spring": Load(stiffness=1e-4),
    "dashpot": Load(damping=1e-4),
    "all": Load(mass=5e-5, stiffness=2e-4, damping=3e-5),
}


def of_circuit(netlist: Netlist, s: Complex = S) -> dict[str, Complex]:
    """Transfer functions from the drive, C (s I - A)^-1 B + D."""
    system = state_space([netlist])
    a, b, c, d = system.a[0], system.b[0, :, :1], system.c[0], system.d[0, :, :1]
    rows = c @ np.linalg.solve(s[:, None, None] * np.eye(len(a)) - a, b) + d
    return dict(zip(system.output_names, rows[:, :, 0].T, strict=True))


def by_hand(strip: Actuator, tip: str, load: Load, s: Complex = S) -> dict[str, Complex]:
    """EC (17) with Re before the port and -ZL v for F, positive towards the anode (hence N for -N)."""
    g, m, k = strip.geometry, strip.material, strip.coupling
    assert k is not None
    area = g.length * g.width
    rdc = m.dc_resistivity * g.thickness / area
    re = (
        m.electrode_resistivity_1 * m.electrode_thickness_1 + m.electrode_resistivity_2 * m.electrode_thickness_2
    ) / area
    branches = [(b.dynamic_resistivity * g.thickness / area, b.permittivity * area / g.thickness) for b in m.branches]
    lf = g.load_distance
    stiffness = m.youngs_modulus * g.width * g.thickness**3 / (4 * lf**3)
    mass = 3 * g.free_length**4 * m.density * g.width * g.thickness / (lf**3 * 1.875104068711961**4)
    zp = 1 / sum(1 / (r + 1 / (c * s)) for r, c in branches)
    d = k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)
    n = 3 * lf**2 / g.thickness**2 * d * s * zp
    z1 = stiffness / s
    z2 = mass * s + 2 * m.beam_damping_ratio * np.sqrt(stiffness * mass)
    zl = load.mass * s + load.damping + load.stiffness / s
    reflected = n**2 * z1 if tip == "clamped" else n**2 * z1 * (z2 + zl) / (z1 + z2 + zl)
    admittance = 1 / rdc + 1 / (zp + reflected)
    u = 1 / (1 + re * admittance)
    i1 = u / (zp + reflected)
    moves = 0 if tip == "clamped" else 1
    # where mass and spring cancel, at resonance, rounding is that of the two
    parts = np.abs(load.mass * s) + load.damping + np.abs(load.stiffness / s)
    condition = parts / np.abs(zl) if load else np.ones(len(s))
    condition = condition + (parts + np.abs(z1) + np.abs(z2)) / np.abs(z1 + z2 + zl)
    v = moves * n * i1 * z1 / (z1 + z2 + zl)
    return {
        "condition": condition,
        "current": admittance * u,
        "charge": i1 / s,
        "displacement": v / s,
        "force": zl * v if moves else n * i1 * z1,
        # what the displacement is a small difference of: the free one, and the filter's node voltages
        "rounding": 1e-11 * np.abs(n * i1 / s)
        + 1e-14 * 3 * lf**2 / g.thickness**2 * k.static * (1 + k.natural_frequency / (2 * k.damping_ratio * k.zero)),
    }


def assert_equal(found: dict[str, Complex], expected: dict[str, Complex], tolerance: float = 1e-9) -> None:
    mechanical = tolerance + 2e-12 * expected["condition"]
    for name, allowed in (("current", tolerance), ("charge", tolerance), ("force", mechanical)):
        assert (np.abs(found[name] - expected[name]) <= allowed * np.abs(expected[name])).all(), name
    error = np.abs(found["displacement"] - expected["displacement"])
    assert (
        error
        <= mechanical * np.abs(expected["displacement"]) + (4 + 0.1 * expected["condition"]) * expected["rounding"]
    ).all()


# -- the full port -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
@pytest.mark.parametrize("which", ["paper", "electrodes", "rc2", "rc2 electrodes", "load inside", "undamped"])
def test_free_tip_is_ec_17(strips: dict[str, Actuator], which: str, load: Load) -> None:
    found = of_circuit(strip_netlist(strips[which], tip="free", load=load))
    assert_equal(found, by_hand(strips[which], "free", load))


@pytest.mark.parametrize("which", ["paper", "electrodes", "rc2", "rc2 electrodes", "load inside", "undamped"])
def test_clamped_tip_is_ec_17(strips: dict[str, Actuator], which: str) -> None:
    found = of_circuit(strip_netlist(strips[which], tip="clamped"))
    assert_equal(found, by_hand(strips[which], "clamped", Load()))


@settings(max_examples=40)
@given(
    random_strips(most_branches=3),
    st.one_of(
        st.just(Load()),
        st.builds(Load, log_floats(1e-6, 1e-2), log_floats(1e-6, 1e-2), log_floats(1e-6, 1e-2)),
    ),
)
def test_random_strips_are_ec_17(strip: Actuator, load: Load) -> None:
    assert_equal(of_circuit(strip_netlist(strip, load=load)), by_hand(strip, "free", load))
    assert_equal(of_circuit(strip_netlist(strip, tip="clamped")), by_hand(strip, "clamped", Load()))


def strongly_coupled() -> Actuator:
    """A strip whose motion acts back on its current, unlike the paper's (there by 1e-10)."""
    k = PAPER.coupling
    assert k is not None
    return replace(
        PAPER,
        material=replace(PAPER.material, youngs_modulus=1e9),
        coupling=replace(k, gain=100 * k.gain),
    )


@pytest.mark.parametrize("load", LOADS.values(), ids=LOADS)
def test_reflection_is_there_when_it_matters(load: Load) -> None:
    strip = strongly_coupled()
    for tip, hangs in (("free", load), ("clamped", Load())):
        found, expected = of_circuit(strip_netlist(strip, tip=tip, load=hangs)), by_hand(strip, tip, hangs)
        assert_equal(found, expected)
        alone = of_circuit(strip_netlist(strip, tip=tip, beam="static"))
        if tip == "clamped":
            assert np.abs(found["current"] / alone["current"] - 1).max() > 1e-3


def test_the_port_is_reciprocal() -> None:
    """EC (19)'s matrix is symmetric: force per volt clamped = -charge per metre short-circuited, both k d(s) K.

    With a free tip and a heavy load the tip hardly moves: then its force is that of the clamped tip.
    """
    strip = strongly_coupled()
    clamped = of_circuit(strip_netlist(strip, tip="clamped"))["force"]
    heavy = of_circuit(strip_netlist(strip, load=Load(stiffness=1e9)))["force"]
    assert heavy == pytest.approx(clamped, rel=1e-3)
    # reflected admittance from the port's own current must be (force per volt)^2 s/K to first order
    lumped, s = lumped_elements(PAPER), S[20:21]
    zp = lumped.ion_impedance(s[0])
    force = of_circuit(strip_netlist(PAPER, tip="clamped"), s)["force"][0]
    assert force == pytest.approx(lumped.coupling_factor(s[0]) * lumped.stiffness / (s[0] * zp), rel=1e-8)


# -- the simplified relations ------------------------------------------------------------------------------------------


def coupling(strip: Actuator, s: Complex) -> Complex:
    k = strip.coupling
    assert k is not None
    return k.gain * (s + k.zero) / (s**2 + 2 * k.damping_ratio * k.natural_frequency * s + k.natural_frequency**2)


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_clamped_force_tends_to_ec_26(beam: str) -> None:
    g, m = PAPER.geometry, PAPER.material
    expected = 3 * coupling(PAPER, S) * g.thickness * g.width * m.youngs_modulus / (4 * g.load_distance)
    found = of_circuit(strip_netlist(PAPER, tip="clamped", beam=beam))["force"]
    assert found == pytest.approx(expected, rel=1e-8 if beam == "dynamic" else 1e-12)


def test_free_displacement_tends_to_ec_29() -> None:
    g = PAPER.geometry
    expected = 3 * coupling(PAPER, S) * g.load_distance**2 / g.thickness**2
    assert of_circuit(strip_netlist(PAPER, beam="static"))["displacement"] == pytest.approx(expected, rel=1e-12)
    slow = np.abs(S) < 0.005  # far below the tip's resonance at 1.39 rad/s
    found = of_circuit(strip_netlist(PAPER))["displacement"]
    assert found[slow] == pytest.approx(expected[slow], rel=3e-3)


def test_electrodes_take_their_share_of_the_voltage(strips: dict[str, Actuator]) -> None:
    """EC (26), (29) refer to the port: at rest it has Rdc/(Rdc + Re) of the source's voltage."""
    slow = np.array([1e-9j])
    without = of_circuit(strip_netlist(PAPER, beam="static"), slow)["displacement"]
    with_electrodes = of_circuit(strip_netlist(strips["electrodes"], beam="static"), slow)["displacement"]
    rdc = lumped_elements(PAPER).port.dc_resistance
    assert with_electrodes / without == pytest.approx(rdc / (rdc + 2.0), rel=1e-6)


@pytest.mark.parametrize("which", ["paper", "electrodes", "rc2", "rc2 electrodes"])
@pytest.mark.parametrize("tip", ["free", "clamped"])
def test_static_beam_reflects_nothing(strips: dict[str, Actuator], which: str, tip: str) -> None:
    lumped = lumped_elements(strips[which])
    port = electrical_netlist(lumped.port.dc_resistance, lumped.port.branches, lumped.port.electrode_resistance)
    found, alone = of_circuit(strip_netlist(strips[which], tip=tip, beam="static")), of_circuit(port)
    assert found["current"] == pytest.approx(alone["current"], rel=1e-12)
    assert found["charge"] == pytest.approx(alone["charge"], rel=1e-12)


def test_electrical_port_is_ec_2() -> None:
    r1, r2, c, re = 600.0, 20.0, 0.35, 5.0
    d = r1 * r2 + re * (r1 + r2)
    expected = ((r1 + r2) * c * S + 1) / (d * c * S + r1 + re)
    found = of_circuit(electrical_netlist(r1, ((r2, c),), re))
    assert found["current"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("tip", ["free", "clamped"])
def test_charge_is_that_on_the_capacitors(strips: dict[str, Actuator], tip: str) -> None:
    """Not the integral of the current: Rdc leaks. At rest it is C u."""
    slow = np.array([1e-9j])
    for which in ("paper", "rc2"):
        total = lumped_elements(strips[which]).port.capacitance
        found = of_circuit(strip_netlist(strips[which], tip=tip, beam="static"), slow)
        assert found["charge"][0].real == pytest.approx(total, rel=1e-6)


# -- tip, load, mounting -----------------------------------------------------------------------------------------------


def test_idle_outputs_are_zero() -> None:
    assert not of_circuit(strip_netlist(PAPER))["force"].any()
    assert not of_circuit(strip_netlist(PAPER, tip="clamped"))["displacement"].any()
    assert not of_circuit(strip_netlist(PAPER, beam="static"))["force"].any()
    assert not of_circuit(strip_netlist(PAPER, tip="clamped", beam="static"))["displacement"].any()


def heavy(share: float) -> Actuator:
    """The paper's strip, so dense that gravity has this share of its stiffness when it hangs."""
    own = lumped_elements(PAPER).stiffness

    def excess(density: float) -> float:
        strip = replace(PAPER, material=replace(PAPER.material, density=density))
        return hanging_stiffness(strip) / own - share

    density = float(brentq(excess, 1e-3, 1e3, xtol=1e-12, rtol=1e-14))
    return replace(PAPER, material=replace(PAPER.material, density=density))


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_hanging_gravity_is_a_spring_at_the_tip(share: float) -> None:
    strip, stiffness = heavy(share), lumped_elements(PAPER).stiffness
    hanging = of_circuit(strip_netlist(replace(strip, mounting=Mounting("hanging"))))
    spring = by_hand(strip, "free", Load(stiffness=share * stiffness))
    assert hanging["displacement"] == pytest.approx(spring["displacement"], rel=1e-7)
    assert not hanging["force"].any()  # gravity is no load: the strip exerts nothing on anybody
    free = by_hand(strip, "free", Load())
    assert abs(hanging["displacement"][0] / free["displacement"][0]) == pytest.approx(1 / (1 + share), rel=1e-3)


def test_hanging_with_a_load() -> None:
    strip, load = heavy(0.5), Load(mass=2e-5, stiffness=1e-4, damping=1e-5)
    found = of_circuit(strip_netlist(replace(strip, mounting=Mounting("hanging")), load=load))
    pull = hanging_stiffness(strip, load.mass)
    assert pull > hanging_stiffness(strip)  # the load has weight
    with_spring = by_hand(strip, "free", replace(load, stiffness=load.stiffness + pull))
    assert found["displacement"] == pytest.approx(with_spring["displacement"], rel=1e-6)
    impedance = load.mass * S + load.damping + load.stiffness / S
    assert found["force"] == pytest.approx(impedance * S * with_spring["displacement"], rel=1e-6)


def test_a_strip_that_is_nothing_beside_its_weight_is_refused() -> None:
    strip_netlist(replace(PAPER, mounting=Mounting("hanging")))
    film = replace(PAPER, material=replace(PAPER.material, youngs_modulus=1.0), mounting=Mounting("hanging"))
    with pytest.raises(InputError, match="is nothing beside the weight"):
        strip_netlist(film)


def test_a_horizontal_weight_moves_the_rest_only() -> None:
    lying = strip_netlist(replace(PAPER, mounting=Mounting("horizontal")))
    assert lying.elements == strip_netlist(PAPER).elements


def test_without_coupling_there_is_only_the_port(strips: dict[str, Actuator]) -> None:
    netlist = strip_netlist(strips["no coupling"])
    assert [o.name for o in netlist.outputs] == ["current", "charge"]
    with pytest.raises(InputError, match=r"has no \[coupling\]; a load needs one"):
        strip_netlist(strips["no coupling"], load=Load(mass=1e-3))


@pytest.mark.parametrize(
    ("how", "hint"),
    [
        ({"tip": "loose"}, "tip is 'loose'; choose free or clamped"),
        ({"beam": "stiff"}, "beam is 'stiff'; choose dynamic or static"),
        ({"tip": "clamped", "load": Load(mass=1.0)}, "a load moves with the tip"),
        ({"beam": "static", "load": Load(mass=1.0)}, "a load moves with the tip"),
    ],
)
def test_what_does_not_go_together(how: dict[str, object], hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        strip_netlist(PAPER, **how)


@pytest.mark.parametrize("name", ["mass", "stiffness", "damping"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_impossible_loads(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"load {name} is .* it must be zero or more"):
        Load(**{name: value})


def test_an_empty_load_is_none() -> None:
    assert not Load()
    assert Load(mass=1e-9)
    assert strip_netlist(PAPER, tip="clamped", load=Load()) == strip_netlist(PAPER, tip="clamped")


def test_the_scale_of_the_mechanical_side_is_stated() -> None:
    assert "1 V = 1 uN, 1 A = 1 mm/s" in strip_netlist(PAPER).comments[0]
