"""Exported netlists under every analysis: .op, .dc, .ac about a bias, .tran with and without uic, by other engines.

Three strips of one library stand in each circuit, with free, open and loaded tip; one run of ngspice does all analyses.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from spice import LINEAR, MODELS, MOUNTED, gnucap, ngspice, with_gnucap, with_ngspice

from ilg_circuit.circuit import Load, strip_netlist
from ilg_circuit.circuit.deck import deck
from ilg_circuit.circuit.library import library
from ilg_circuit.circuit.operating_point import with_operating_point
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.simulation.impedance import impedance
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import Actuator
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

BIAS = 2.0
DURATION = 5.0
RISE = 1e-6
LOAD = Load(mass=1e-5, stiffness=3e-5, damping=1e-5)
HOW: tuple[dict[str, Any], ...] = ({}, {"tip": "clamped"}, {"load": LOAD})
STRIPS = {name: strip for name, strip in (MODELS | MOUNTED).items() if name != "undamped"}  # rings for ever
#: Quantities of the circuit, in SI units as these times them: currents, ways of the free and loaded tip, forces.
UNITS = {
    "i(vi1)": 1.0,
    "i(vi2)": 1.0,
    "i(vi3)": 1.0,
    "v(x1.way)": 1e-3,
    "v(t2)": 1e-6,
    "v(x3.way)": 1e-3,
}


def circuit(strip: Actuator) -> list[str]:
    """Three strips, as the header of a library says, and a source of 2 V under the analyses' own."""
    given = f" load_stiffness={LOAD.stiffness}"
    given += f" load_mass={LOAD.mass}" if strip.mounting.orientation == "hanging" else ""
    lines = ["* three strips", ".include strip.lib", f"Vdc a 0 dc {BIAS} ac 1"]
    for k in (1, 2, 3):
        lines += [f"Vi{k} plus p{k} 0", f"X{k} p{k} 0 t{k} ilg_strip{given if k == 3 else ''}"]
    for k, end in ((1, "0"), (3, "l3")):
        lines.append(f"Vt{k} t{k} {end} 0")
    return [
        *lines,
        f"L3 l3 r3 {1e3 * LOAD.mass!r} ic=0",
        f"R3 r3 0 {1e3 * LOAD.damping!r}",
    ]


def settled(strip: Actuator, voltage: Array) -> dict[str, Array]:
    """What rests under a constant voltage: Ohm's law, and springs; what is reflected is nothing beside it."""
    lumped, loaded = lumped_elements(strip), lumped_elements(strip, hung=LOAD.mass)
    assert lumped.coupling
    inner = np.array([lumped.port.inner_voltage(u) for u in voltage])
    current = lumped.port.electron_current(inner)
    free, stiffness = lumped.bending_ratio * lumped.coupling.static * inner, lumped.stiffness
    way = free * stiffness / (stiffness + loaded.gravity + LOAD.stiffness)
    return {
        **{f"i(vi{k})": current for k in (1, 2, 3)},
        "v(x1.way)": free * stiffness / (stiffness + lumped.gravity),
        "v(t2)": free * stiffness,
        "v(x3.way)": way,
    }


def moving(strip: Actuator, times: Array, rest: float) -> dict[str, Array]:
    """This package's answer to a step by 2 V from ``rest``, ten times better than it is compared to.

    From a rest under a voltage the step has a rise: ngspice gives up on a jump at the operating point.
    """
    rising = PiecewiseLinear(np.array([0.0, RISE, 1e3]), np.array([rest, rest + BIAS, rest + BIAS]), "step", rest=rest)
    drive = rising if rest else PiecewiseLinear.step(BIAS)
    drive = drive.from_rest() if strip_netlist(strip).linear else drive
    found = {}
    linear = strip_netlist(strip).linear
    before = settled(strip, np.array([rest])) if rest and linear else {}
    for k, how in enumerate(HOW, 1):
        if rest and not linear and k == 3:
            continue  # a nonlinear strip at rest under a voltage has no load
        beam = "static" if k == 2 else None  # a clamped beam's force at rest is in d(s), not in its compliance
        netlist = strip_netlist(strip, rest=0.0 if linear else rest, beam=beam, **how)
        waves = transient(
            netlist, drive, times, engine="exact" if linear else "ngspice", accuracy=1e-7, interpolate=False
        )
        found[f"i(vi{k})"] = waves.output("current")
        found |= {f"v(x{k}.way)": waves.output("displacement")} if k != 2 else {"v(t2)": waves.output("force")}
    return {name: wave + before.get(name, 0.0) for name, wave in found.items()}


def agree(found: dict[str, Array], expected: dict[str, Array], close: float, what: str) -> None:
    for name, wave in expected.items():
        size = float(np.abs(wave).max())
        assert size > 0, name
        assert_allclose(UNITS[name] * found[name], wave, rtol=0, atol=close * size, err_msg=f"{what}: {name}")


# -- plain ngspice -----------------------------------------------------------------------------------------------------


def results(path: Path) -> dict[str, Array]:
    """The columns of a file that ngspice's wrdata wrote, complex ones of .ac too."""
    names = path.read_text(encoding="utf-8").partition("\n")[0].split()
    values = np.loadtxt(path, skiprows=1, ndmin=2)
    first = dict.fromkeys(names)
    at = {name: [k for k, n in enumerate(names) if n == name] for name in first}
    found = {n.lower(): values[:, k[0]] + (1j * values[:, k[1]] if len(k) > 1 else 0.0) for n, k in at.items()}
    return {"scale": values[:, 0]} | found


@with_ngspice
@pytest.mark.parametrize("which", STRIPS)
def test_ngspice_under_every_analysis(which: str, tmp_path: Path) -> None:
    strip = STRIPS[which]
    text = library(strip)
    (tmp_path / "strip.lib").write_text(text)
    first, longest = 1e-9 * DURATION, 2e-4 * DURATION
    analyses = {
        "op": "op",
        "dc": "dc vdc -3 3 0.75",
        "ac": "ac dec 3 10m 10",
        "uic": f"tran {first!r} {DURATION!r} 0 {longest!r} uic",
        "tran": f"tran {first!r} {DURATION!r} 0 {longest!r}",
    }
    written = " ".join(UNITS)
    lines = [*circuit(strip), "Vstep plus a dc 0",
             ".options reltol=1e-8 trtol=1 abstol=1e-12 vntol=1e-10 chgtol=1e-4 method=trap",
             ".control", "set numdgt=15 wr_singlescale wr_vecnames"]  # fmt: skip
    for name, analysis in analyses.items():
        if name == "tran":
            lines.append(f"alter @vstep[pwl] = [ 0 0 {RISE} {BIAS} 1000 {BIAS} ]")
        lines += [analysis, f"wrdata {name}.txt {written}"]
    (tmp_path / "all.cir").write_text("\n".join([*lines, "quit 0", ".endc", ".end", ""]))
    printed = ngspice(tmp_path, "all.cir")
    assert not [line for line in printed.splitlines() if "rror" in line or "singular" in line or "tepping" in line]
    found = {name: results(tmp_path / f"{name}.txt") for name in analyses}
    agree(found["op"], settled(strip, np.array([BIAS])), 1e-6, ".op")
    agree(found["dc"], settled(strip, found["dc"]["scale"]), 1e-6, ".dc")
    for k, how in enumerate(HOW, 1):
        z = impedance(strip, found["ac"]["scale"], bias=BIAS, engine="exact", **how).impedance
        assert_allclose(z * found["ac"][f"i(vi{k})"], 1.0, rtol=0, atol=1e-6, err_msg=f".ac {how}")
    for name in ("uic", "tran"):
        time = np.minimum(found[name]["scale"], DURATION)
        assert time[-1] == DURATION
        at = np.unique(np.linspace(0, len(time) - 1, 40).astype(int))
        at = at[(time[at] > 2 * RISE) & (np.diff(time[at], prepend=-1.0) > 0)]
        picked = {q: wave[at] for q, wave in found[name].items()}
        agree(picked, moving(strip, time[at], 0.0 if name == "uic" else BIAS), 1e-6, f".tran, {name}")


@with_ngspice
@pytest.mark.parametrize("which", ["rc3", "warburg", "rc2 growing sinh", "hanging"])
@pytest.mark.parametrize("how", HOW, ids=["free", "clamped", "loaded"])
def test_a_deck_at_rest(which: str, how: dict[str, Any], tmp_path: Path) -> None:
    strip = STRIPS[which]
    text = deck(strip_netlist(strip, **how), PiecewiseLinear.step(BIAS), DURATION, strip)
    assert text.startswith("* ")
    assert "LTspice puts 1 mohm into every inductor" in text
    assert "Rser=0" in text
    tail = [
        ".control",
        "set numdgt=15 wr_singlescale wr_vecnames",
        f"alter vdrive dc={BIAS}",
        "op",
        "wrdata op.txt all",
    ]
    tail += ["ac dec 3 10m 10", "wrdata ac.txt v(out_current)", "quit 0", ".endc", ".end", ""]
    body = [line for line in text.splitlines() if not line.startswith((".tran", ".print", ".end", "Vdrive", "+"))]
    body.append("Vdrive drive 0 0 AC 1")  # .op has a PWL source at its beginning, which is 0 V
    (tmp_path / "deck.cir").write_text("\n".join([*body, *tail]))
    ngspice(tmp_path, "deck.cir")
    found = results(tmp_path / "op.txt")
    rest = settled(strip, np.array([BIAS]))
    way = {"loaded": rest["v(x3.way)"], "free": rest["v(x1.way)"]}
    expected = {"out_current": rest["i(vi1)"]}
    if how.get("tip") == "clamped":
        expected["out_force"] = rest["v(t2)"]
    else:
        expected["out_displacement"] = way["loaded" if how else "free"]
    if "load" in how:
        expected["out_force"] = LOAD.stiffness * way["loaded"]
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-6), name
    ac = results(tmp_path / "ac.txt")
    z = impedance(strip, ac["scale"], bias=BIAS, engine="exact", **how).impedance
    assert_allclose(z * ac["v(out_current)"], 1.0, rtol=0, atol=1e-6)


# -- gnucap ------------------------------------------------------------------------------------------------------------


#: Where gnucap's transient from an operating point takes seconds; with stiff beams and sinh it takes minutes.
LIVELY = ("rc", "rc2", "rc3", "warburg", "cpe", "randles")


@with_gnucap
@pytest.mark.parametrize("which", [n for n in STRIPS if "growing" not in n])  # gnucap has no behavioural sources
def test_gnucap_under_every_analysis(which: str, tmp_path: Path) -> None:
    strip = STRIPS[which]
    (tmp_path / "strip.lib").write_text(library(strip))
    names = ("i(vi1)", "i(vi2)", "i(vi3)", "v(x1.way)", "v(t2)", "v(x3.way)")
    printed = " ".join(f"{n.replace('x1.way', 'X1.Rway').replace('x3.way', 'X3.Rway')}(20.12)" for n in names)
    parts = " ".join(f"ir(Vi{k})(20.12) ii(Vi{k})(20.12)" for k in (1, 2, 3))
    lines = [*circuit(strip), f"Vstep plus a dc 0 pwl(0 0 {RISE} {BIAS} 1000 {BIAS})"]
    lines += [
        ".options short=1e-7 reltol=1e-6 chgtol=1e-7 numdgt=9 method=gear noincmode",
        *(f".print dc {printed}", ".dc Vdc 0.75 3 0.75"),
        *(f".print op {printed}", ".op"),
        *(f".print ac {parts}", ".ac decade 3 0.01 10"),
    ]
    if which in LIVELY:
        lines += [f".print tran {printed}", f".tran 0.1 {DURATION} 0"]
    lines += [".end", ""]
    (tmp_path / "all.cir").write_text("\n".join(lines))
    dc, op, ac, *trans = gnucap(tmp_path, "all.cir")
    for table, voltage, what in ((dc, dc[:, 0], ".dc"), (op, np.array([BIAS]), ".op")):
        rest = settled(strip, voltage)
        if which == "hanging":
            del rest["v(t2)"]  # the header says so: gnucap takes the path of an open, stiff tip for none
        agree(dict(zip(names, table.T[1:], strict=True)), rest, 1e-3, what)
    for k, how in enumerate(HOW):
        z = impedance(strip, ac[:, 0], bias=BIAS, engine="exact", **how).impedance
        assert_allclose(z * (ac[:, 1 + 2 * k] + 1j * ac[:, 2 + 2 * k]), 1.0, rtol=0, atol=1e-3, err_msg=f".ac {how}")
    for tran in trans:
        late = tran[tran[:, 0] > 0.999][::5]
        agree(dict(zip(names, late.T[1:], strict=True)), moving(strip, late[:, 0], BIAS), 1e-3, ".tran")


@pytest.mark.parametrize("name", [name for name in MODELS if name not in LINEAR])
def test_a_run_from_a_rest_under_a_voltage_starts_with_the_tip_where_that_holds_it(name: str) -> None:
    lumped = lumped_elements(MODELS[name])
    assert lumped.coupling
    held = lumped.bending_ratio * lumped.coupling.static * lumped.port.inner_voltage(BIAS)
    way = next(e for e in with_operating_point(strip_netlist(MODELS[name], rest=BIAS)).elements if e.name == "Cway")
    assert way.start * UNITS["v(x1.way)"] == pytest.approx(held, rel=1e-9)
