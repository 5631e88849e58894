"""The law of bending of a displacement: chosen by BIC, its gains with their signs, its strip through a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import Synthetic

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.identification import Identification, identify
from ilg_circuit.simulation.prediction_band import prediction_band
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.couplings import ChargeCoupling, CouplingLaw, VoltageRelaxations
from ilg_circuit.strip.file import dumps, loads

STEP = PiecewiseLinear.step(2.0)
TIME = np.arange(0.0, 100.1, 0.2)
CHARGE = ChargeCoupling(instantaneous=90e-9, gain_1=-50e-9, time_1=20.0)


def record(law: CouplingLaw | None, seed: int = 1, noise: float = 0.01) -> Synthetic:
    """A step of 2 V after a rest of 10 s, the displacement with noise of 1 % of its span."""
    run = simulate(replace(PAPER, coupling=law), STEP, TIME, engine="exact", beam="static")
    random, rest = np.random.default_rng(seed), np.arange(-10.0, 0.0, 0.2)
    time = np.append(rest, TIME)
    moved = np.append(np.zeros(len(rest)), run.displacement)
    moved = moved + noise * np.ptp(moved) * random.standard_normal(len(time))
    current = np.append(np.zeros(len(rest)), run.current)
    current = current + 1e-4 * run.current.max() * random.standard_normal(len(time))
    voltage = np.where(time < 0, 0.0, 2.0)
    return Synthetic({"time": time + 10, "voltage": voltage, "current": current, "displacement": moved}, PAPER)


def fitted(law: CouplingLaw | None, name: str, seed: int = 1) -> Identification:
    return identify(record(law, seed).measurement(), base=PAPER, model="rc", engine="exact", law=name)


def test_a_strip_that_follows_charge_is_recognised() -> None:
    found = fitted(CHARGE, "auto")
    law = found.actuator.coupling
    assert isinstance(law, ChargeCoupling)
    (told,) = [f for f in found.findings if f.code == "coupling-chosen"]
    assert told.values["law"] == "the charge and 1 relaxation of it"
    assert told.values["window"] == pytest.approx(100.0, abs=0.5)
    # the sizes of gains are fitted, their signs told
    for name, true in (("instantaneous", 90e-9), ("gain_1", -50e-9), ("time_1", 20.0)):
        estimate = found.parameters[f"coupling_{name}"]
        assert estimate.value == pytest.approx(getattr(law, name))
        assert estimate.interval is not None
        low, high = estimate.interval
        assert low < estimate.value < high
        assert abs(estimate.value - true) < 4 * estimate.stderr
    assert loads(dumps(found.actuator)) == found.actuator
    # the gains cancel in part: their sum is told with an interval of its own
    total = found.derived["displacement_per_volt"]
    assert total.interval is not None
    assert total.interval[0] < 10800 * 40e-9 < total.interval[1]
    assert total.stderr < 0.02 * total.value
    # the covariance of the strip is carried through as any other
    band = prediction_band(found.actuator, STEP, TIME[::50], engine="exact").stderr["displacement"]
    assert 0 < band[-1] < 0.03 * 10800 * 80e-9


def test_a_law_that_the_data_do_not_tell_apart_is_named() -> None:
    """Three relaxations of the voltage, one of them at Rd C, are the charge and two relaxations of it."""
    law = VoltageRelaxations(gain_1=100e-9, time_1=1.5, gain_2=-80e-9, time_2=6.8, gain_3=100e-9, time_3=50.0)
    found = fitted(law, "auto")
    assert found.coupling is not None
    rows = {row.law: row for row in found.coupling.laws}
    assert rows["charge2"].chosen
    assert [name for name, row in rows.items() if row.alike] == ["voltage3"]
    (told,) = [f for f in found.findings if f.code == "coupling-alike"]
    assert told.values["others"] == "3 relaxations of the voltage"
    assert "as good as the chosen one" in found.summary()
    assert found.to_dict()["displacement"]["laws"][list(rows).index("voltage3")]["alike"]


def test_d_of_s_wins_where_it_is_true() -> None:
    found = fitted(PAPER.coupling, "auto")
    assert found.actuator.coupling is not None
    assert found.actuator.coupling.kind == "voltage"


def test_a_law_can_be_named() -> None:
    law = VoltageRelaxations(gain_1=120e-9, time_1=2.0, gain_2=-70e-9, time_2=20.0)
    found = fitted(law, "voltage2").actuator.coupling
    assert isinstance(found, VoltageRelaxations)
    assert found.gain_1 == pytest.approx(120e-9, rel=0.05)
    assert found.gain_2 == pytest.approx(-70e-9, rel=0.05)
    assert found.time_2 == pytest.approx(20.0, rel=0.1)
    with pytest.raises(InputError, match="is 'chrge'; choose one of auto, ec31, charge1"):
        fitted(law, "chrge")


def test_the_laws_compete_where_the_clock_is_fitted() -> None:
    """A camera 0.6 s late: d(s) beside its own delay is no better than the charge beside the right one."""
    made = record(CHARGE)
    time, moved = made.columns["time"], made.columns["displacement"]
    late = made.changed(displacement=np.interp(time - 0.6, time, moved)).measurement()
    found = identify(late, base=PAPER, model="rc", engine="exact", displacement_delay="fit")
    assert isinstance(found.actuator.coupling, ChargeCoupling)
    low, high = found.derived["displacement_delay"].reported[1]
    assert low <= 0.6 <= high
    assert high - low < 0.1


def test_files_of_different_gains_share_the_law() -> None:
    files = [
        replace(record(CHARGE.scaled(gain), seed).measurement(), source=f"{seed}.csv")
        for seed, gain in ((1, 0.6), (2, 1.0), (3, 1.5))
    ]
    found = identify(files, base=PAPER, model="rc", engine="exact")
    (told,) = [f for f in found.findings if f.code == "coupling-gains-differ"]
    assert told.values["highest"] / told.values["lowest"] == pytest.approx(2.5, rel=0.1)
    assert found.coupling is not None
    (chosen,) = [row for row in found.coupling.laws if row.chosen]
    assert (chosen.law, chosen.prediction) == ("charge1", pytest.approx(0.01, rel=0.2))
    times = found.parameters["coupling_time_1"]
    assert abs(times.value - 20.0) < 4 * times.stderr
    own = [found.own[f.source]["coupling_instantaneous"].value / 90e-9 for f in files]
    assert own == pytest.approx([0.6, 1.0, 1.5], rel=0.1)
    # a strip like any of them: the band contains their scatter
    band = prediction_band(found.actuator, STEP, TIME[::100], engine="exact").stderr["displacement"]
    assert band[-1] > 0.3 * 10800 * 80e-9
