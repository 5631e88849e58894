"""How often the error that `simulate` states bounds the true one, and by how much it is larger.

Random strips of every model, drives, loads and sample times, against the equations solved by themselves
(`strip_equations`). Writes STATED_ERROR.md.

python benchmarks/stated_error.py [--linear 1000] [--nonlinear 300] [--exact 200] [--seed 1] [--state FILE] [--list]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from figure import Figure
from machine import conditions
from nonlinear_equations import nonlinear_reference
from strip_equations import Run, linear_reference, lumped, modes_of

from ilg_circuit.circuit import Load
from ilg_circuit.drive import Drive, PiecewiseLinear
from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, Coupling, Geometry, Mounting
from ilg_circuit.strip.models import Ladders, electrical_model

RESULTS = Path(__file__).with_name("STATED_ERROR.md")
QUANTITIES = ("current", "displacement", "energy")
LINEAR = ("rc", "rc", "rc2", "rc3", "warburg", "cpe", "randles", "rc+inductance", "rc2+inductance", "cpe+inductance")
NONLINEAR = (
    "rc+growing", "rc2+growing", "rc3+growing", "rc+sinh", "rc2+sinh", "rc2+growing+sinh", "warburg+sinh", "cpe+sinh",
)  # fmt: skip
LADDERS = ("warburg", "cpe", "randles")


@dataclass(frozen=True)
class Judged:
    """What came of one run: by quantity, the stated and the true error, relative to the largest value."""

    told: str
    stated: dict[str, float]
    true: dict[str, float]
    seconds: float

    @property
    def ratio(self) -> float:
        """The largest true error over the stated one, of the quantities each."""
        return max(self.true[q] / self.stated[q] if self.stated[q] else np.inf for q in self.true)

    def line(self) -> str:
        """All in one line."""
        pairs = " ".join(f"{q} {self.stated[q]:.1e}/{self.true[q]:.1e}" for q in self.true)
        return f"{'MISS' if self.ratio > 1 else 'ok'} {self.ratio:.2g} {pairs} {self.seconds:.2f} s {self.told}"

    @property
    def larger(self) -> float:
        """How many times the largest stated error is larger than the largest true one."""
        return max(self.stated.values()) / max(*self.true.values(), 1e-300)


def random_strip(rng: np.random.Generator, model: str, end: float) -> Actuator:
    """A strip whose time constants and the length of a run may be met: from the run's thousandth to ten times it."""

    def within(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    size = within(2, 200)
    slowest = end * within(0.03, 3)
    values = {"dc_resistance": size * within(5, 100), "dynamic_resistance": size, "capacitance": slowest / size}
    for k in (1, 2, 3):
        r, tau = size * within(0.5, 4), slowest / within(2, 8) ** (3 - k)
        values |= {f"resistance_{k}": r, f"capacitance_{k}": tau / r}
    exponent, tau = float(rng.uniform(0.4, 0.95)), slowest
    values |= {
        "series_resistance": size * within(0.1, 1),
        "warburg_resistance": size * within(0.5, 5),
        "diffusion_time": tau,
        "cpe_coefficient": slowest**exponent / size,
        "cpe_exponent": exponent,
        "interface_resistance": size * within(0.2, 1),
        "interface_time": tau * within(0.003, 0.1),
        "interface_exponent": float(rng.uniform(0.6, 0.95)),
        "diffusion_exponent": float(rng.uniform(0.38, 0.47)),
        "emission_voltage": within(0.3, 3),
        "inductance": size * end * within(1e-6, 1e-3),
        "capacitance_slope": within(0.03, 1),
    }
    kind = electrical_model(model)
    electrodes = size * within(0.02, 0.5) if rng.random() < 0.6 else 0.0
    if "sinh" in model and model.startswith(LADDERS):
        electrodes = 0.0
    port = kind.port([values[n] for n in kind.names], electrodes, Ladders())
    free = within(0.01, 0.05)
    geometry = Geometry(
        free * rng.uniform(1.0, 1.3), free, within(2e-3, 1e-2), within(1e-4, 1e-3),
        free * rng.uniform(0.5, 1.0) if rng.random() < 0.5 else None,
    )  # fmt: skip
    # so stiff that the tip swings from less than once to a hundred times in the run
    stiff = 3.9 * PAPER.material.density * (within(3, 700) / end * free**2 / geometry.thickness) ** 2 / 4.12
    bend = 3 * free**2 / geometry.thickness**2
    wn = within(0.5, 20) / end
    coupling = Coupling(1.0, wn * within(0.2, 5), within(0.2, 2), wn)
    # so that a volt moves the tip by 0.1 to 3 mm
    coupling = replace(coupling, gain=within(1e-4, 3e-3) / bend / coupling.static)
    base = replace(PAPER.material, youngs_modulus=stiff, beam_damping_ratio=within(0.05, 1.0))
    made = Actuator.from_port(geometry, port, base=base, coupling=coupling if rng.random() < 0.9 else None)
    material = replace(made.material, ladder_lowest=None, ladder_highest=None, ladder_sections=None)
    hanging = Mounting("hanging") if rng.random() < 0.1 else Mounting()
    return replace(made, material=material, mounting=hanging)


def random_drive(rng: np.random.Generator, end: float) -> Drive:
    """A step, square wave, sine, ramp, or lines and jumps as a file gives."""
    volts = float(rng.uniform(0.3, 4) * rng.choice([-1, 1]))
    match rng.choice(["step", "square", "sine", "ramp", "file"]):
        case "step":
            return parse_drive(f"step:{volts!r}V", end)
        case "square":
            low = rng.choice(["0", repr(-volts), repr(0.3 * volts)])
            period = end / float(np.exp(rng.uniform(np.log(0.7), np.log(12))))
            return parse_drive(f"square:{low}V..{volts!r}V,{period!r}s,{rng.uniform(0.1, 0.9)!r}", end)
        case "sine":
            return parse_drive(f"sine:{volts!r}V,{float(np.exp(rng.uniform(np.log(0.3), np.log(50)))) / end!r}Hz", end)
        case "ramp":
            return parse_drive(f"ramp:{volts / end!r}V/s", end)
        case _:
            count = int(rng.integers(2, 40))
            times = np.sort(rng.uniform(0, end, count))
            times[0] = 0.0
            for k in np.flatnonzero(rng.random(count - 1) < 0.2):
                times[k + 1] = times[k]
            return PiecewiseLinear(times, volts * rng.uniform(-1, 1, count).round(3), "file")


def random_times(rng: np.random.Generator, end: float) -> Any:
    """Few, usual, or many samples; even, random or logarithmic ones."""
    match rng.choice(["even", "even", "random", "log"]):
        case "even":
            return np.linspace(0, end, int(rng.choice([2, 3, 7, 11, 51, 301, 601, 2001])))
        case "random":
            return np.unique(np.append(rng.uniform(0, end, int(rng.choice([1, 4, 30, 200]))), end))
        case _:
            return np.geomspace(end * 10 ** rng.uniform(-6, -2), end, int(rng.choice([5, 40, 200])))


def random_run(rng: np.random.Generator, models: tuple[str, ...]) -> tuple[Run, str]:
    """One run, and a few words that name it."""
    end = float(10 ** rng.uniform(-0.5, 3))
    model = str(rng.choice(models))
    strip, drive, times = random_strip(rng, model, end), random_drive(rng, end), random_times(rng, end)
    tip, beam, load = str(rng.choice(["free", "free", "clamped"])), str(rng.choice(["dynamic", "static"])), None
    if strip.coupling is None:
        tip, beam = "free", "dynamic"
    elif tip == "free" and beam == "dynamic" and rng.random() < 0.6:
        own = lumped(Run(strip, drive, times), float)
        sizes = np.array([own["mass"], own["k"], np.sqrt(own["k"] * own["mass"])])
        load = Load(*(sizes * 10 ** rng.uniform(-2, 1, 3) * (rng.random(3) < 0.6)).tolist())
    return Run(strip, drive, times, tip, beam, load), f"{model}, {drive.text}, {len(times)} samples, {tip}, {beam}"


def judged(run: Run, told: str, engine: str = "ngspice") -> Judged:
    """Simulate and compare."""
    begin = perf_counter()
    found = simulate(run.strip, run.drive, run.times, tip=run.tip, beam=run.beam, load=run.load, engine=engine)
    seconds = perf_counter() - begin
    linear = found.netlist.linear
    expected = linear_reference(run, modes_of(run)) if linear else nonlinear_reference(run)
    stated, true = {}, {}
    for name in QUANTITIES:
        values = found.waveforms[name]
        scale = np.abs(values).max()
        if np.isnan(values).any() or not scale:
            continue
        true[name] = float(np.abs(values - expected[name]).max() / scale)
        stated[name] = getattr(found, "errors", {}).get(name, found.error)
    return Judged(told, stated, true, seconds)


def runs(
    count: int, models: tuple[str, ...], seed: int, engine: str = "ngspice", seconds: float = np.inf, first: int = 0
) -> Iterator[Judged | str]:
    """Runs of ``models`` judged from the ``first`` on, for so many ``seconds``; of one that is refused, the words."""
    begin = perf_counter()
    for k in range(first, count):
        if perf_counter() - begin > seconds:
            return
        run, told = random_run(np.random.default_rng([seed, k]), models)
        try:
            yield judged(run, f"#{k} {told}", engine)
        except (InputError, SolveError) as error:
            yield f"#{k} {told}: {error}"


class State:
    """What came of earlier runs, line by line in a file of JSON, if there is one; ``seed`` is that of its runs."""

    def __init__(self, path: Path | None, seed: int) -> None:
        self._path, self._seed = path, seed
        lines = path.read_text(encoding="utf-8").splitlines() if path and path.exists() else []
        self._known = [json.loads(line) for line in lines]

    def of(self, name: str) -> list[Judged | str]:
        """The runs of a kind that are done, in their order."""
        kept = [one["found"] for one in self._known if (one["kind"], one["seed"]) == (name, self._seed)]
        return [one if isinstance(one, str) else Judged(**one) for one in kept]

    def add(self, name: str, found: Judged | str) -> None:
        """Keep one more."""
        if self._path:
            one = found if isinstance(found, str) else asdict(found)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"kind": name, "seed": self._seed, "found": one}) + "\n")


def table(name: str, found: list[Judged | str]) -> list[str]:
    """Rows of counts: by quantity, and of all together."""
    kept = [j for j in found if isinstance(j, Judged)]
    rows = []
    for quantity in QUANTITIES:
        pairs = np.array([(j.stated[quantity], j.true[quantity]) for j in kept if quantity in j.true])
        held = int((pairs[:, 1] <= pairs[:, 0]).sum())
        larger = np.median(pairs[:, 0] / np.maximum(pairs[:, 1], 1e-300))
        worst = float((pairs[:, 1] / np.maximum(pairs[:, 0], 1e-300)).max())
        rows.append(
            f"| {name} | {quantity} | {len(pairs)} | {held} ({held / len(pairs):.1%}) | {larger:.1f} | {worst:.2g} | "
            f"{np.median(pairs[:, 1]):.1e} |"
        )
    held = sum(j.ratio <= 1 for j in kept)
    larger = float(np.median([j.larger for j in kept]))
    rows.append(f"| {name} | all three | {len(kept)} | {held} ({held / len(kept):.1%}) | {larger:.1f} | | |")
    return rows


def main() -> list[Figure]:
    """Measure, write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--linear", type=int, default=1000)
    parser.add_argument("--nonlinear", type=int, default=300)
    parser.add_argument("--exact", type=int, default=200, help="linear runs of the exact engine")
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so long, with what is done by then")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", type=Path, help="file of JSON lines that a later call goes on from")
    parser.add_argument("--list", action="store_true", help="print every run, write no page")
    asked = parser.parse_args()
    rows: list[str] = []
    missed: list[str] = []
    refused: list[str] = []
    figures: list[Figure] = []
    state = State(asked.state, asked.seed)
    for name, count, models, engine in (
        ("linear, ngspice", asked.linear, LINEAR, "ngspice"),
        ("nonlinear, ngspice", asked.nonlinear, NONLINEAR, "ngspice"),
        ("linear, exact engine", asked.exact, LINEAR, "exact"),
    ):
        found = state.of(name)[:count]
        share = count / (asked.linear + asked.nonlinear + asked.exact)
        for one in runs(count, models, asked.seed, engine, 60 * asked.minutes * share, len(found)):
            found.append(one)
            state.add(name, one)
            if asked.list:
                print(one if isinstance(one, str) else one.line(), flush=True)
        if not any(isinstance(one, Judged) for one in found):
            continue
        rows += table(name, found)
        figures.append(Figure(f"stated error bounds the true one: {name}", rows[-1].split("|")[4].strip()))
        missed += [f"- {name}: {j.told}: {j.ratio:.2g} times" for j in found if isinstance(j, Judged) and j.ratio > 1]
        refused += [f"- {name}: {j}" for j in found if isinstance(j, str)]
    head = [
        "# Stated errors beside true ones", "", "Written by `benchmarks/stated_error.py`.", "",
        *conditions(("ilg-circuit", "numpy", "scipy", "mpmath")), "",
        f"Random strips of every model, drives, loads and sample times, seed {asked.seed}, by `simulate` with its",
        "default accuracy; the true error is the difference from the equations solved by themselves",
        "(`strip_equations.py`). Both are relative to the largest value of a waveform.", "",
        "| runs | quantity | number | stated bounds true | stated/true, median | true/stated, worst | true, median |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    text = "\n".join([*head, *rows, "", "Not bounded:", "", *(missed or ["- none"]), "", "Refused with a message:", "",
                      *(refused or ["- none"])]) + "\n"  # fmt: skip
    print("\n".join([*rows, *missed, *refused]))
    if not asked.list:
        RESULTS.write_text(text, encoding="utf-8")
    return figures


if __name__ == "__main__":
    main()
