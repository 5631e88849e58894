"""Several files of one strip together: what they share, what each has for itself, what one says of another."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kinds import data, identified
from synthetic import record, scaled, spectrum, step, two_branches

from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.fit.estimate import Estimate
from ilg_circuit.identification import Identification, identify
from ilg_circuit.measurements.read import read_record
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.simulation.prediction_band import prediction_band
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

M = PAPER.material
PLAIN = replace(PAPER, coupling=None)
SINH = replace(PAPER, material=replace(M, emission_voltage=0.8), coupling=None, name="sinh")
DIFFUSING = replace(PAPER, material=replace(M, diffusion_time=30.0), coupling=None, name="diffusing")


def steps(strip: Actuator, *voltages: float, offset: float = 0.0) -> list[Record]:
    return [
        record(step(u), 120.0, 241, strip=strip, rest=20, noise=2e-3, seed=k, current_offset=offset * k).measurement(
            f"{k}.csv"
        )
        for k, u in enumerate(voltages)
    ]


def moving(voltage: float, source: str, **how: Any) -> Record:
    """A record with a displacement."""
    made = record(step(voltage), 150.0, 151, rest=20, displacement=True, noise=3e-3, **how)
    return made.measurement(source)


def assert_holds(p: Estimate, truth: float, most: float) -> None:
    """The truth within four standard errors, and these below the part ``most`` of it."""
    assert p.stderr is not None
    assert abs(p.value - truth) < 4 * p.stderr
    assert p.stderr < most * truth


def assert_narrower(joint: Identification, alone: Identification, names: tuple[str, ...]) -> None:
    for name in names:
        own, shared = alone.parameters[name].stderr, joint.parameters[name].stderr
        assert own is not None
        assert shared is not None
        assert shared < own


# -- steps -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def linear() -> Identification:
    return identify(steps(PLAIN, 4.0, -2.0, 1.0, offset=1e-3), model="rc", base=PLAIN, engine="exact")


def test_offsets_are_each_record_s_own(linear: Identification) -> None:
    assert linear.fit.nuisance == pytest.approx([0.0, 1e-3, 2e-3], abs=3e-4)
    assert [o.derived["current_offset"].value for o in linear.observations] == linear.fit.nuisance.tolist()


def test_each_record_is_as_good_as_by_itself_and_predicted_by_the_others(linear: Identification) -> None:
    for o in linear.observations:
        assert o.rms_joint == pytest.approx(o.rms_individual, rel=0.1)
        assert o.rms_predicted == pytest.approx(o.rms_individual, rel=0.2)
    assert not linear.findings


def test_the_joint_interval_is_narrower_than_any_record_s_own(linear: Identification) -> None:
    for file in steps(PLAIN, 4.0, -2.0, 1.0, offset=1e-3):
        alone = identify(file, base=PLAIN, model="rc", engine="exact")
        assert_narrower(linear, alone, ("dynamic_resistance", "capacitance"))


def test_very_different_sampling() -> None:
    sparse = record(step(2.0), 300.0, 16, strip=PLAIN, noise=2e-3, seed=3).measurement()
    dense = record(step(-1.0), 40.0, 4001, strip=PLAIN, rest=50, noise=2e-3, seed=4).measurement()
    found = identify([sparse, dense], model="rc", base=PLAIN)
    lumped = lumped_elements(PLAIN)
    for p, value in zip(found.parameters.values(), (lumped.port.dc_resistance, *lumped.port.branches[0]), strict=False):
        assert_holds(p, value, 1.0)
    assert found.observations[0].rms_joint < 1.6 * found.observations[0].rms_individual


def test_files_of_one_name_are_told_apart() -> None:
    files = [replace(file, source="same.csv") for file in steps(PLAIN, 4.0, 2.0)]
    found = identify(files, model="rc", base=PLAIN, engine="exact")
    assert found.sources == ("same.csv (1)", "same.csv (2)")


def test_one_record_given_twice_is_refused() -> None:
    (one,) = steps(PAPER, 3.0)
    with pytest.raises(InputError, match=r"repeats the readings of '0\.csv \(1\)': give each record once"):
        identify([one, one], model="rc")


# -- what is not linear, and Re ----------------------------------------------------------------------------------------


def test_several_voltages_determine_a_nonlinear_electron_path() -> None:
    found = identify(steps(SINH, 1.0, -2.0, 3.0), model="rc+sinh", base=SINH)
    assert_holds(found.parameters["emission_voltage"], 0.8, 0.06)


def test_a_linear_model_of_a_nonlinear_strip_does_not_hold_for_all() -> None:
    found = identify(steps(SINH, 1.0, 3.0), model="rc", base=SINH, engine="exact")
    assert "files-inconsistent" in codes(found.findings)
    assert max(o.rms_joint / o.rms_individual for o in found.observations) > 1.5


def test_one_voltage_is_not_enough_for_a_nonlinear_model_and_that_is_said() -> None:
    made = steps(SINH, 2.0, -2.0)
    for files in (made, made[:1]):
        with pytest.raises(InputError, match="needs several voltages"):
            identify(files, model="rc+sinh", base=SINH)


def test_a_spectrum_about_zero_and_a_step_tell_what_is_not_ohmic() -> None:
    """Re Z at low frequency is Rdc near 0 V, the step's steady current the chord at 2 V: two voltages."""
    high = record(step(2.0), 100.0, 101, strip=SINH, rest=10, noise=2e-3, seed=3).measurement("step.csv")
    about = [spectrum(SINH, 1e-4, 10.0), spectrum(SINH, 1e-4, 10.0, bias=1.0, seed=1, source="biased.csv")]
    found = identify([high, *about], model="rc+sinh", base=SINH, bias=[0.0, 0.0, 1.0])
    assert_holds(found.parameters["emission_voltage"], 0.8, 0.02)
    assert_holds(found.parameters["dc_resistance"], lumped_elements(SINH).port.dc_resistance, 0.02)
    assert [o.voltage for o in found.observations] == [2.0, 0.0, 1.0]


def test_re_is_determined_by_what_is_not_linear() -> None:
    """Re = 2 ohm divides the voltage of the sinh law: several voltages tell it, to some per cent."""
    strip = replace(SINH, material=replace(SINH.material, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6))
    found = identify(steps(strip, 1.0, -2.0, 3.0), model="rc+sinh", base=SINH, electrode_resistance="fit")
    p = found.parameters["electrode_resistance"]
    assert_holds(p, 2.0, 0.1)
    assert not p.fixed_because
    assert found.actuator.uncertainty is not None
    assert "electrode_resistance" in found.actuator.uncertainty.names
    band = prediction_band(found.actuator, step(2.0), np.linspace(0.0, 60.0, 31))
    assert 0 < band.stderr["current"].max() < 1e-3


def test_re_that_is_not_there_is_held_at_zero_and_said() -> None:
    made = [record(step(u), 60.0, 31, strip=SINH, rest=5, noise=5e-3).measurement(f"{u}.csv") for u in (1.0, 3.0)]
    found = identify(made, model="rc+sinh", base=SINH, electrode_resistance="fit")
    assert found.parameters["electrode_resistance"].fixed_because
    assert "electrode-resistance-not-determined" in codes(found.findings)
    assert found.parameters["emission_voltage"].value == pytest.approx(0.8, abs=0.04)
    for o in found.observations:
        assert o.predicted is None
        assert "the others are all at one voltage" in o.not_predicted_because


@pytest.mark.parametrize("several", [False, True])
def test_re_of_a_linear_port_cannot_be_fitted(several: bool) -> None:
    files = steps(PLAIN, 4.0, 2.0)[: 1 + several]
    with pytest.raises(InputError, match="for every Re below"):
        identify(files, model="rc", electrode_resistance="fit")
    with pytest.raises(InputError, match="not with auto"):
        identify(files, electrode_resistance="fit")


# -- own parameters, files that do not belong --------------------------------------------------------------------------


def test_what_one_record_does_not_share_is_its_own() -> None:
    # the chords of the sinh law, 5.2 ohm per volt and more, behind what both share
    found = identify(steps(SINH, 1.0, -3.0), model="rc", base=SINH, own=["dc_resistance"], engine="exact")
    lumped = lumped_elements(SINH)
    chords = [u / (lumped.port.saturation_current * np.sinh(u / 0.8)) for u in (1.0, 3.0)]
    own = [found.own[source]["dc_resistance"] for source in found.sources]
    for p, chord in zip(own, chords, strict=True):
        assert_holds(p, chord, 1.0)
    assert found.parameters["dc_resistance"].value == pytest.approx(np.sqrt(own[0].value * own[1].value))
    assert found.parameters["capacitance"].value == pytest.approx(lumped.port.capacitance, rel=0.01)
    assert all(o.rms_joint < 1.1 * o.rms_individual for o in found.observations)
    # of what is its own the others know only their mean
    assert all(o.rms_predicted is not None and o.rms_predicted > 3 * o.rms_individual for o in found.observations)
    entry = json.loads(json.dumps(found.to_dict()))["own"]
    assert entry["0.csv"]["dc_resistance"]["unit"] == "ohm"
    assert "own to each record" in found.summary()


@pytest.mark.parametrize("several", [False, True])
def test_an_own_parameter_that_the_model_does_not_have(several: bool) -> None:
    with pytest.raises(InputError, match="model rc has no stiffness"):
        identify(steps(PLAIN, 4.0, 2.0)[: 1 + several], model="rc", own=["stiffness"], engine="exact")


def test_a_stranger_among_three_is_named() -> None:
    (other,) = steps(replace(scaled(size=1.5), coupling=None), 2.5)
    files = [*steps(PLAIN, 3.0, -2.0), replace(other, source="odd")]
    found = identify(files, model="rc", base=PLAIN, engine="exact")
    (finding,) = (f for f in found.findings if f.code == "file-outlying")
    assert "one port holds for all files except odd" in str(finding)
    assert "files-inconsistent" in codes(found.findings)


def test_a_bad_record_among_good_ones_is_named() -> None:
    good, second = steps(PAPER, 3.0, -2.0)
    hum = 0.03 * np.sin(0.6 * second.current.time)
    bad = replace(second, current=replace(second.current, values=second.current.values + hum), source="bad.csv")
    found = identify([good, bad], model="rc", engine="exact")
    (finding,) = (f for f in found.findings if f.code == "file-not-described")
    assert str(finding).startswith("no port describes bad.csv (")
    # it has little weight: the good one still decides
    assert found.parameters["capacitance"].value == pytest.approx(0.35, rel=0.02)


# -- two kinds ---------------------------------------------------------------------------------------------------------

TWO = replace(two_branches(), coupling=None)
BRANCHES = ("resistance_1", "capacitance_1", "resistance_2", "capacitance_2")


def of_two_branches() -> list[Record | Spectrum]:
    """The spectrum ends where the slow branch begins, the step begins where the fast one is over."""
    slow = record(step(2.0), 200.0, 101, strip=TWO, rest=10, noise=3e-3, seed=1)
    return [slow.measurement("step.csv"), spectrum(TWO, 1e-2, 1e3)]


@pytest.fixture(scope="module")
def two_kinds() -> Identification:
    return identify(of_two_branches(), model="rc2", base=TWO)


def test_a_step_and_a_spectrum_together(two_kinds: Identification) -> None:
    truth = [x for pair in lumped_elements(TWO).port.branches for x in pair]
    for name, value in zip(BRANCHES, truth, strict=True):
        assert_holds(two_kinds.parameters[name], value, 0.15)
    assert [o.quantity for o in two_kinds.observations] == ["current", "impedance"]
    assert all(o.rms_joint < 1.2 * o.rms_individual for o in two_kinds.observations)
    assert not two_kinds.findings
    assert_narrower(two_kinds, identify(of_two_branches()[0], base=TWO, model="rc2"), BRANCHES)


def test_what_the_data_fix_is_given_beside_the_re_that_was_held(two_kinds: Identification) -> None:
    """Another Re makes other elements, and the same port: resistances at both ends stay, and so does every misfit."""
    held = two_kinds.parameters["electrode_resistance"]
    assert "no current or spectrum of a linear port fixes it (any Re below 17" in held.fixed_because
    other = identify(of_two_branches(), model="rc2", base=TWO, electrode_resistance=10.0)
    for name in ("steady_resistance", "high_frequency_resistance"):
        a, b = two_kinds.derived[name], other.derived[name]
        assert b.value == pytest.approx(a.value, rel=1e-4)
        assert a.stderr is not None
        assert b.stderr == pytest.approx(a.stderr, rel=0.02)
    assert other.parameters["resistance_1"].value < 0.6 * two_kinds.parameters["resistance_1"].value
    for mine, theirs in zip(two_kinds.observations, other.observations, strict=True):
        assert theirs.rms_joint == pytest.approx(mine.rms_joint, rel=1e-4)


def test_diffusion_from_a_short_step_and_a_spectrum_that_each_see_half_of_it() -> None:
    short = record(step(-1.0), 20.0, 81, strip=DIFFUSING, rest=10, noise=3e-3, seed=2).measurement("step.csv")
    found = identify([short, spectrum(DIFFUSING, 3e-2, 1e2)], model="warburg", base=DIFFUSING)
    port = lumped_elements(DIFFUSING).port
    assert port.ladder is not None
    assert_holds(found.parameters["warburg_resistance"], port.ladder.constants[0], 0.05)
    assert_holds(found.parameters["diffusion_time"], 30.0, 0.1)
    fitted = found.actuator.material
    assert fitted.ladder_lowest is not None
    assert fitted.ladder_lowest <= 3e-2
    assert fitted.ladder_highest is not None
    assert fitted.ladder_highest >= 1e2


# -- displacements -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def moved() -> Identification:
    """Three records, two of them with a displacement, each with a rest position of its own, one with a drift."""
    still = record(step(1.0), 150.0, 151, rest=20, noise=3e-3, seed=3).measurement("c")
    files = [
        moving(4.0, "a", rest_position=5e-3, seed=1),
        moving(-2.0, "b", rest_position=-1e-3, drift=2e-6, seed=2),
        still,
    ]
    return identify(files, model="rc", base=PAPER, engine="exact")


def test_the_coupling_is_one_for_all_records_that_move(moved: Identification) -> None:
    truth = PAPER.coupling
    assert truth is not None
    for name in ("gain", "zero", "damping_ratio", "natural_frequency"):
        assert_holds(moved.parameters[f"coupling_{name}"], getattr(truth, name), 0.05)
    assert moved.coupling is not None
    assert [d.source for d in moved.coupling.data] == ["a", "b"]
    assert moved.coupling.individual[1].drift == pytest.approx(2e-6, rel=0.1)
    for own in moved.coupling.individual:
        assert (moved.coupling.fit.errors < own.fit.errors).all()


def test_displacements_are_predicted_from_the_others_too(moved: Identification) -> None:
    rows = [o for o in moved.observations if o.quantity == "displacement"]
    assert [o.source for o in rows] == ["a", "b"]
    for o in rows:
        assert o.rms_joint < 1.1 * o.rms_individual
        assert o.rms_predicted is not None
        assert o.rms_predicted < 1.3 * o.rms_individual
    assert [o.derived["rest_position"].value for o in rows] == pytest.approx([5e-3, -1e-3], abs=1e-4)
    listed = [(r["source"], r["quantity"]) for r in moved.to_dict()["records"]]
    assert listed == [*((s, "current") for s in "abc"), ("a", "displacement"), ("b", "displacement")]


@pytest.mark.parametrize("resistance", [None, 2.0])
def test_one_displacement_among_several_files_is_predicted_by_none(resistance: float | None) -> None:
    found = identify(
        [moving(4.0, "a", seed=1), *steps(PLAIN, -2.0, 1.0)],
        model="rc", base=PAPER, engine="exact", electrode_resistance=resistance,
    )  # fmt: skip
    *currents, displacement = found.observations
    assert all(o.rms_predicted == pytest.approx(o.rms_individual, rel=0.2) for o in currents)
    assert displacement.predicted is None
    assert "no other file" in displacement.not_predicted_because


def test_a_camera_on_the_other_side_is_named() -> None:
    files = [
        moving(u, f"{k}.csv", axis=axis, seed=k) for k, (u, axis) in enumerate(((4.0, 1.0), (-2.0, 1.0), (3.0, -1.0)))
    ]
    found = identify(files, model="rc", base=PAPER, engine="exact")
    (finding,) = (f for f in found.findings if f.code == "displacement-opposed")
    assert finding.subject == "2.csv"
    assert found.coupling is not None
    assert [d.source for d in found.coupling.data] == ["0.csv", "1.csv"]


def test_files_are_in_the_order_given() -> None:
    found = identify(data("several")[::-1], base=PAPER, model="rc", engine="exact")
    assert found.sources == ("z.csv", "back.csv", "step.csv")
    for name, p in found.parameters.items():
        assert p.value == pytest.approx(identified("several").parameters[name].value, rel=1e-4)


def test_the_real_step_split_in_two(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    """Every second sample each: two records of one strip, which predict one another."""
    header, *rows = shared_data("ipmc_step/step_1V5.csv").read_text().splitlines()
    made = []
    for name, k in zip(("even", "odd"), count(), strict=False):
        path = tmp_path / f"{name}.csv"
        path.write_text("\n".join([header, *rows[k::2]]))
        made.append(replace(read_record(path), displacement=None))
    found = identify(made, model="rc2")
    for o in found.observations:
        assert o.rms_predicted is not None
        assert o.rms_joint < 1.2 * o.rms_individual
        assert o.rms_predicted < 1.6 * o.rms_individual
        assert 0.003 < o.rms_individual / o.size < 0.02
    whole = identify(replace(read_record(shared_data("ipmc_step/step_1V5.csv")), displacement=None), model="rc2")
    for name in ("resistance_1", "capacitance_2"):
        assert found.parameters[name].value == pytest.approx(whole.parameters[name].value, rel=0.1)
    assert found.parameters["resistance_1"].autoregression is not None
