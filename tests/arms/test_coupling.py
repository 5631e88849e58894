"""From a rhythm through the strips' circuits to strains: against transfer functions and the exact engine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.arms import circuits, coupling, read_motion, simulate, strip_arm
from ilg_circuit.arms.circuits import through_circuits
from ilg_circuit.arms.coupling import Coupled, couple, lumped_strain, segment_strip, strip_charge, unit_of_segment
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.oscillators.network import chain, ring, unit
from ilg_circuit.report import motion as motion_report
from ilg_circuit.report.arm import coupling_table
from ilg_circuit.simulation.response import transient_band
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import PAPER, Actuator

Array = NDArray[np.float64]

#: Slower by, then per mode the part of the ideal amplitude kept and the phase [deg].
SCALES = [
    (1.0, {"circuit": (0.0044, -91), "charge": (0.024, -89)}),
    (10.0, {"circuit": (0.046, -100), "charge": (0.24, -76)}),
    (100.0, {"circuit": (0.975, -56), "charge": (0.92, -22)}),
]
KINDS: dict[str, dict[str, float]] = {
    "warburg": {"diffusion_time": 20.0},
    "growing": {"capacitance_slope": 0.2},
    "emission": {"emission_voltage": 1.5},
}


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer samples of a rhythm, for long runs."""
    monkeypatch.setattr(coupling, "_SAMPLES", 200)


def strip_of(kind: str) -> Actuator:
    return replace(PAPER, name=kind, material=replace(PAPER.material, **KINDS[kind]))


def fundamental(found: Coupled, values: Array) -> NDArray[np.complex128]:
    """Of values (t, n) over the last whole period: (n,)."""
    period = found.run.period
    assert period is not None
    time = found.time[-1] - period * np.arange(2000) / 2000
    turned = np.exp(-2j * np.pi * time / period)
    return np.array([2 * (np.interp(time, found.time, column) * turned).mean() for column in values.T])


def exact(strip: Actuator, time: Array, voltage: Array) -> tuple[Array, Array]:
    """Charge [C] and strain (t,) by the exact engine under the same straight lines."""
    netlist = strip_netlist(strip, beam="static", band=transient_band(time))
    waves = transient(netlist, PiecewiseLinear(time, voltage), time, engine="exact")
    g = strip.geometry
    return waves.output("charge"), waves.output("displacement") * g.thickness / g.length**2


def test_the_printed_table() -> None:
    for mode in ("circuit", "charge"):
        found = couple(unit(), 1, 0.2, mode=mode)
        for scale, (slower, expected) in zip(found.scales, SCALES, strict=True):
            kept, phase = expected[mode]
            assert scale.period == pytest.approx(1.035463 * slower, rel=1e-6)
            assert scale.kept == pytest.approx(kept, rel=0.025)
            assert scale.phase == pytest.approx(phase, abs=0.6)
        lines = coupling_table(found).splitlines()
        assert lines[0] == f"coupling {mode}: what is left of the ideal strain of 0.00221"
        assert len(lines) == 5
    slow = replace(found, scales=(replace(found.scales[0], phase=-0.2),))
    assert coupling_table(slow).endswith(" 0 deg")  # not -0
    assert coupling_table(found).splitlines()[-1].split() == ["103.5", "s", "92.43%", "-22", "deg"]


def test_ideal_coupling_keeps_everything() -> None:
    found = couple(unit(), 2, 4.1)
    assert [(s.kept, s.phase) for s in found.scales] == [(1.0, 0.0)] * 3
    assert not found.charges.any()
    # in the end the strain swings between the ends of what the largest voltage gives
    last = found.strains[found.time > 2.9]
    assert np.ptp(last, axis=0) / 2 == pytest.approx([found.largest_strain] * 2, rel=1e-4)
    assert found.warnings == ()


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(("slower", "expected"), SCALES)
def test_the_strains_in_the_end_agree_with_the_table(slower: float, expected: dict[str, tuple[float, float]]) -> None:
    duration = {1.0: 80.0, 10.0: 120.0, 100.0: 420.0}[slower]
    for mode, (kept, phase) in expected.items():
        found = couple(unit(), 1, duration, mode=mode, slower=slower)
        ideal = found.largest_strain / 4.0 * fundamental(found, found.voltages)
        ratio = (fundamental(found, found.strains) / ideal)[0]
        assert abs(ratio) == pytest.approx(kept, rel=0.025)
        assert np.degrees(np.angle(ratio)) == pytest.approx(phase, abs=0.8)
        # and far closer to the transfer function that the table is made of
        assert abs(ratio) == pytest.approx(found.scales[0].kept, rel=2e-3)
        assert np.degrees(np.angle(ratio)) == pytest.approx(found.scales[0].phase, abs=0.2)


@pytest.mark.parametrize("mode", ["circuit", "charge"])
def test_the_strains_are_those_of_the_exact_engine(mode: str) -> None:
    found = couple(chain(3), 3, 0.6, mode=mode)
    strip = segment_strip(PAPER, 3)
    assert found.error < 1e-6
    assert np.ptp(found.voltages, axis=1).max() > 0.5  # every segment has a voltage of its own
    for k in range(3):
        charge, strain = exact(strip, found.time, found.voltages[:, k])
        if mode == "charge":
            strain = found.largest_strain * charge / (strip_charge(strip) * 4.0)
        assert found.charges[:, k] == pytest.approx(charge, abs=1e-6 * np.abs(charge).max())
        assert found.strains[:, k] == pytest.approx(strain, abs=1e-6 * np.abs(strain).max())


def test_segments_of_another_length_strain_alike() -> None:
    short, long = (couple(unit(), 2, 0.5, mode="circuit", segment_length=length) for length in (2e-3, 20e-3))
    assert short.strains == pytest.approx(long.strains, abs=1e-8 * np.abs(long.strains).max())
    assert 10 * short.charges == pytest.approx(long.charges, abs=1e-8 * np.abs(long.charges).max())


def test_voltages_of_their_own() -> None:
    time = np.linspace(0, 2.0, 801)
    waves = np.stack([np.sin(3 * time), -2 * np.sin(3 * time), 4 * time, 0 * time], axis=1)
    _, together, _ = through_circuits(segment_strip(PAPER, 4), time, waves)
    for k in range(3):
        _, alone, _ = through_circuits(segment_strip(PAPER, 4), time, waves[:, [k]])
        assert together[:, k] == pytest.approx(alone[:, 0], abs=1e-9 * np.abs(alone).max())
    assert together[:, 1] == pytest.approx(-2 * together[:, 0], abs=1e-12)
    assert not together[:, 3].any()


@pytest.mark.usefixtures("coarse")
def test_the_lags_of_a_chain_survive_the_circuit() -> None:
    found = couple(chain(4), 4, 60.0, mode="circuit")
    strains, voltages = (fundamental(found, waves) for waves in (found.strains, found.voltages))
    lags = -np.degrees(np.angle(strains[1:] / strains[:-1]))
    assert lags == pytest.approx(-np.degrees(np.angle(voltages[1:] / voltages[:-1])), abs=0.1)
    # the voltage of the first unit alone is not cut off at the top: that moves its phase a little
    assert lags[0] == pytest.approx(found.run.rhythm.unit_lags[1], abs=0.5)
    assert lags[1:] == pytest.approx(found.run.rhythm.unit_lags[2:], abs=0.2)
    assert lags[-1] == pytest.approx(24.1, abs=0.2)


def test_voltages_are_bounded_and_so_is_what_they_give() -> None:
    assert lumped_strain(PAPER, 4.0) == pytest.approx(2.21e-3, rel=1e-3)
    found = couple(unit(tonic=3.0), 2, 2.0, voltage=2.5, reference=0.462)
    assert np.abs(found.outputs).max() > 1.3
    assert found.voltages.max() == 2.5
    assert found.voltages.min() == -2.5
    assert found.largest_strain == pytest.approx(2.211387e-3 * 2.5 / 4, rel=1e-6)


def test_a_reference_makes_the_tonic_input_scale_the_strains() -> None:
    one, half = (couple(unit(tonic=e), 1, 2.0, reference=0.6, start=[0.12 * e, 0, 0, 0]) for e in (1.0, 0.5))
    assert half.strains == pytest.approx(0.5 * one.strains, abs=1e-12)
    free = couple(unit(tonic=0.5), 1, 2.0, start=[0.06, 0, 0, 0])
    assert free.strains[-1] == pytest.approx(one.strains[-1] * 0.6 / 0.462008, rel=1e-5)


def test_a_positive_output_bends_towards_the_normal() -> None:
    arm = strip_arm(segments=4)
    for mode in ("ideal", "circuit"):
        found = couple(unit(), 4, 0.3, mode=mode)
        assert found.outputs[-1].min() > 0
        motion = simulate(arm, found.activation(arm), [0.0, 0.3])
        assert motion.tip[-1, 1] > motion.tip[0, 1]  # +normal is +y for an arm along +x
        assert motion.activations[-1, 0, 0] == pytest.approx(-found.strains[-1, 0])


def test_units_drive_the_segments_nearest_to_them() -> None:
    assert unit_of_segment(2, 5).tolist() == [0, 0, 1, 1, 1]
    assert unit_of_segment(15, 15).tolist() == list(range(15))
    assert unit_of_segment(4, 2).tolist() == [1, 3]
    found = couple(chain(2), 3, 0.3, units=[1, 0, 1])
    assert np.array_equal(found.outputs, found.run.unit_outputs[:, [1, 0, 1]])


@pytest.mark.parametrize("kind", KINDS)
def test_other_strips(kind: str) -> None:
    strip = strip_of(kind)
    found = couple(unit(), 2, 1.0, mode="circuit", actuator=strip)
    assert found.error < 1e-4
    assert found.strains[:, 0] == pytest.approx(found.strains[:, 1], abs=1e-6 * np.abs(found.strains).max())
    piece = segment_strip(strip, 2)
    time, voltages = found.time[::8], found.voltages[::8]
    _, mine, error = through_circuits(piece, time, voltages)
    netlist = strip_netlist(piece, beam="static", band=transient_band(time))
    waves = transient(netlist, PiecewiseLinear(time, voltages[:, 0]), time, accuracy=1e-5)
    strain = waves.output("displacement") * piece.geometry.thickness / piece.geometry.length**2
    assert mine[:, 0] == pytest.approx(strain, abs=(error + 1e-5) * np.abs(strain).max())
    assert error < 1e-4


@pytest.mark.parametrize(
    ("network", "segments", "mode"),
    [(unit(), 3, "circuit"), (chain(3), 4, "charge"), (ring(3, 3.0, one_way=True), 2, "circuit")],
    ids=["unit", "chain", "one-way ring"],
)
def test_neurons_in_the_netlist(network: coupling.Network, segments: int, mode: str) -> None:
    apart = couple(network, segments, 1.5, mode=mode)
    whole = couple(network, segments, 1.5, mode=mode, neurons_in_circuit=True)
    assert 0 < whole.error < 1e-4
    for name in ("strains", "charges", "voltages", "outputs"):
        expected = getattr(apart, name)
        assert getattr(whole, name) == pytest.approx(expected, abs=1e-4 * np.abs(expected).max()), name
    assert whole.voltages[0] == pytest.approx(apart.voltages[0])
    assert not np.array_equal(whole.strains, apart.strains)


def test_neurons_with_a_nonlinear_strip() -> None:
    strip = strip_of("growing")
    apart, whole = (
        couple(unit(tonic=2.0), 2, 1.0, mode="circuit", actuator=strip, reference=0.5, neurons_in_circuit=together)
        for together in (False, True)
    )
    assert np.abs(whole.voltages).max() == pytest.approx(4.0)
    assert whole.strains == pytest.approx(apart.strains, abs=1e-4 * np.abs(apart.strains).max())


def test_what_ngspice_leaves_uncertain_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(circuits, "_LARGEST_ERROR", 1e-12)
    with pytest.raises(SolveError, match="ngspice's strains are uncertain by"):
        couple(unit(), 1, 0.2, mode="circuit")


def test_warnings() -> None:
    assert any("keeps 0.44% of the ideal amplitude" in line for line in couple(unit(), 1, 5.0, mode="circuit").warnings)
    assert couple(unit(), 1, 410.0, mode="circuit", slower=100.0).warnings == ()
    still = couple(unit(1.0), 1, 5.0, mode="circuit")
    assert still.scales == ()
    assert any("does not oscillate" in line for line in still.warnings)
    assert coupling_table(still) == "coupling circuit: no period to compare with"


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        ({"mode": "magic"}, "choose one of ideal, circuit, charge"),
        ({"segments": 0}, "0 segments"),
        ({"voltage": float("nan")}, "voltage nan V must be more than zero"),
        ({"voltage": -1.0}, "voltage -1 V must be more than zero"),
        ({"slower": 0.0}, "0 times slower"),
        ({"reference": 0.0}, "reference 0 must be more than zero"),
        ({"segment_length": -1.0}, "segment length -1 m"),
        ({"duration": 0.0}, "duration 0 s must be more than zero"),
        ({"duration": 1e5}, "at most 2000 can be"),
        ({"units": [0, 1]}, "units name 1"),
        ({"units": [-1, 0]}, "units name -1"),
        ({"units": [0.5, 0.0]}, "give 2 whole numbers"),
        ({"neurons_in_circuit": True}, "no circuit to put the neurons in"),
        ({"actuator": replace(PAPER, coupling=None)}, r"has no \[coupling\]"),
    ],
)
def test_refusals(options: dict[str, Any], hint: str) -> None:
    given: dict[str, Any] = {"network": unit(), "segments": 2, "duration": 1.0} | options
    with pytest.raises(InputError, match=hint) as caught:
        couple(**given)
    assert len(str(caught.value).splitlines()) == 1


def test_a_file_and_an_animation_of_a_driven_arm(tmp_path: Path) -> None:
    arm = strip_arm(segments=3)
    found = couple(chain(3), 3, 1.0, mode="charge")
    times = np.linspace(0, 1.0, 11)
    motion = simulate(arm, found.activation(arm), times)
    motion = replace(motion, signals=found.signals(times))
    motion.write_netcdf(tmp_path / "motion.nc")
    again = read_motion(tmp_path / "motion.nc")
    assert set(again.signals) == {"outputs", "voltages", "charges"}
    for name, values in found.signals(times).items():
        assert np.array_equal(again.signals[name], values)
        assert values.shape == (11, 3)
        assert np.ptp(values[-1]) > 0
    assert motion.to_xarray()["charges"].attrs["units"] == "C"
    one, two = found.portrait(times)
    assert one - two == pytest.approx(again.signals["outputs"][:, 0], abs=1e-12)
    motion_report.animate(motion, tmp_path / "arm.gif", frames_per_second=5, portrait=(one, two))
    assert (tmp_path / "arm.gif").read_bytes().startswith(b"GIF8")
