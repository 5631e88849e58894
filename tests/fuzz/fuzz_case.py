"""One case of the fuzz: a command line or a damaged file, run in this process, and what is wrong with its outcome."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shutil
import signal
import tempfile
import time
import tomllib
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from types import FrameType

import damage
import every_model
import format_texts
import fuzz_lines
import inputs
import numpy as np
import track_texts

from ilg_circuit.cli import main
from ilg_circuit.commands import stopping
from ilg_circuit.errors import IlgWarning, InputError
from ilg_circuit.measurements.kind import LOAD_TEST
from ilg_circuit.measurements.read import read, read_load_test
from ilg_circuit.strip.actuator import PAPER, Actuator, Electrodes, Layer
from ilg_circuit.strip.file import dumps, load_actuator
from ilg_circuit.study.plan import read_plan

#: Processor time [s] that a case may take, and how long searches are given before they end themselves.
LONGEST, LIMIT = 5.0, "4s"
#: Commands whose work is a search over many simulations, which say how long they will take and are ended by an option.
SEARCHES = ("design", "identify", "sense", "sweep")
_NOT_A_NUMBER = re.compile(r"(?<![\w$/.\\-])-?(nan|inf|infinity)(?![\w.])", re.IGNORECASE)
#: A line of progress, which work that takes long shows.
_PROGRESS = re.compile(r"\w+: .*(to go|and more to come)$")
_DESIGNS = "thickness_mm,width_mm,voltage_V\n0.3,5,1\n0.5,,2\n0.8,6,3\n"
_WEIGHTS = "0,2.5,0\n0,0,2.5\n2.5,0,0\n"
_DRIVE = "time_s,voltage_V\n0,0\n1,0\n1,2\n5,-1\n9,3\n"

_TUNED = """{"controller": {"kind": "pi", "gains": {"gain": 5000}, "limit": 4, "delay": 0, "clamps": false,
"state_space": {"a": [[0]], "b_reference": [350], "b_displacement": [-350], "b_excess": [0.07], "c": [1],
"d_reference": 5000, "d_displacement": -5000}}}"""


class TooLongError(BaseException):
    """A case took more than `LONGEST`; no handler of the package's takes it for its own."""


@dataclass(frozen=True)
class Outcome:
    """What came of a case: its exit code, the processor time [s] that it took, and what is wrong, "" if nothing.

    ``limited``: it was a search that its time limit ended.
    """

    code: int
    seconds: float
    wrong: str = ""
    limited: bool = False


def strips() -> dict[str, str]:
    """Return actuator files of several models, by name."""
    models = {"rc2": "rc2", "sinh": "rc+sinh", "growing": "rc+growing", "warburg": "warburg"}
    made = {f"{name}.toml": dumps(every_model.strip_of(model)) for name, model in models.items()}
    plain = Actuator(PAPER.geometry, PAPER.material, name="no $coupling\\")
    four = replace(PAPER, electrodes=Electrodes(0.25, 5.0, segments_1=4, segments_2=2, cells=4))
    carbon = Layer("carbon", 5e-5, 700.0, 1e6, capacitance_per_volume=8e7)
    layered = PAPER.with_layers([carbon, Layer("gel", 4e-4, 1250.0, 7600.0), carbon])
    made |= {"four.toml": dumps(four), "layered.toml": dumps(layered)}
    return made | {"strip.toml": inputs.STRIP, "plain.toml": dumps(plain)}


def write_inputs(folder: Path) -> None:
    """Write the files that good command lines name."""
    names = (
        "step.csv",
        "square.csv",
        "ramps.csv",
        "spectrum.csv",
        "low.csv",
        "uniaxial.csv",
        "equibiaxial.csv",
        "planar",
    )
    inputs.write(folder, [*names, "planar.csv"])
    shutil.copy(folder / "step.csv", folder / "$odd.csv")
    texts = strips() | {"designs.csv": _DESIGNS, "weights.csv": _WEIGHTS, "drive.csv": _DRIVE}
    texts["journal.mplstyle"] = "font.size: 8\nlines.linewidth: 1\n"
    texts["tip.csv"] = track_texts.TRACKS["CSV, pixels"][0]()
    texts["motion.csv"] = _DRIVE.replace("voltage_V", "displacement_mm")
    texts["bend.csv"] = "time_s,curvature_1_1/m,curvature_4_1/m,angle_rad\n0,0,0,0\n5,2,-1,0.02\n9,0,1,0\n"
    texts["segments.csv"] = "time_s,voltage_1_V,voltage_3_V\n0,0,0\n1,2,-1\n5,1,1\n"
    texts["trial.csv"] = "time_s,voltage_V,displacement_mm\n0,0,0\n1,1,0.1\n2,0.5,0.15\n"
    texts["own.py"] = "def step(reference, measured):\n    return 1e3 * (reference - measured)\n"
    texts["tuned.json"] = _TUNED
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")


def warm() -> None:
    """Have the arm's kernels compiled, once after a change of them, before any case is timed.

    And let a time limit wait for what is being computed, since its last resort is to end this process.
    """
    stopping._PATIENCE = LONGEST
    for how in (["--formulation", "beam"], ["--formulation", "yekutieli"], ["--method", "implicit"]):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
            line = ["arm", *how, "--duration", "1ms", "--samples", "2", "--segments", "2", "--out", f"{folder}/a.nc"]
            with contextlib.suppress(SystemExit):
                main(line)


def run_command(seed: int, given: Path) -> Outcome:
    """Run the command line of a seed in a folder with copies of the inputs ``given``."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path(name)
        for path in given.iterdir():
            os.link(path, folder / path.name)
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        out, err = io.StringIO(), io.StringIO()
        line = limited_line(fuzz_lines.command_line(seed))

        def call() -> int:
            try:
                with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                    main(line)
            except SystemExit as end:
                return int(end.code or 0)
            return 0

        found = timed(call)
        if found.wrong:
            return found
        said = err.getvalue()
        if found.code != 2 and ("--json", "-") in pairwise(line):  # the text is on stderr, and JSON alone on stdout
            said = "\n".join(x for x in said.splitlines() if x.startswith(("warning: ", "ilg-circuit: ")))
            try:
                json.loads(out.getvalue())
            except ValueError:
                return replace(found, wrong=f"stdout is not JSON alone: {out.getvalue()[:500]!r}")
        wrong = _faults(found.code, out.getvalue(), said, folder, before)
        return replace(found, wrong=wrong, limited=f"stopped by --time-limit after {LIMIT}" in said)


def limited_line(line: list[str]) -> list[str]:
    """Return a command line with a time limit where it is a search."""
    return [*line, "--time-limit", LIMIT] if line[0] in SEARCHES else line


def read_damaged(seed: int, folder: Path) -> Outcome:
    """Read a damaged file of any kind and format: a measurement, a strip, designs."""
    random = np.random.default_rng([seed, 1])
    kinds: dict[str, Callable[[Path], object]] = dict.fromkeys(format_texts.TEXTS, read)
    kinds[LOAD_TEST.name] = lambda path: read_load_test(path, "uniaxial")
    kinds |= {"strip": load_actuator, "designs": read_plan}
    kind = list(kinds)[int(random.integers(len(kinds)))]
    made = strips()
    texts = format_texts.TEXTS.get(kind) or {
        "strip": {name: (lambda text=text: text) for name, text in made.items()},
        "designs": {"designs": lambda: _DESIGNS},
    }[kind]  # fmt: skip
    path = folder / "damaged.csv"
    path.write_bytes(damage.damaged(seed, texts))
    said = ""

    def call() -> int:
        nonlocal said
        try:
            kinds[kind](path)
        except InputError as error:
            said = str(error)
            return 2
        return 0

    found = timed(call)
    return replace(found, wrong=found.wrong or ("not one line" if "\n" in said or len(said) > 1500 else ""))


def timed(call: Callable[[], int]) -> Outcome:
    """Call with warnings as faults, stopped when it has taken too much processor time."""
    begin = time.process_time()
    code, wrong = -1, ""
    with warnings.catch_warnings(record=True) as warned, _stopped() as stopped:
        warnings.simplefilter("always")
        try:
            code = call()
        except TooLongError:
            pass
        except Exception:  # the fault that is looked for
            wrong = traceback.format_exc(limit=-6)
    if stopped:
        wrong = f"over {LONGEST:g} s of processor time, in {stopped[0]}"
    told = [w for w in warned if not issubclass(w.category, (ResourceWarning, DeprecationWarning, IlgWarning))]
    if told and not wrong:
        wrong = f"warning: {told[0].category.__name__}: {told[0].message} ({told[0].filename}:{told[0].lineno})"
    return Outcome(code, time.process_time() - begin, wrong)


@contextlib.contextmanager
def _stopped() -> Iterator[list[str]]:
    """Yield a list that gets where the block was when it was stopped for taking too long."""
    places: list[str] = []

    def stop(_signal: int, frame: FrameType | None) -> None:
        places.append("".join(traceback.format_stack(frame, limit=4)))
        raise TooLongError

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        yield places
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def _faults(code: int, out: str, err: str, folder: Path, before: dict[str, bytes]) -> str:
    """Return what is wrong with the outcome of a command, "" if nothing."""
    lines = [line for line in err.splitlines() if not line.startswith("warning: ") and not _PROGRESS.match(line)]
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if "Traceback" in err or len(lines) > 1 or any(not line.startswith("ilg-circuit: ") for line in lines):
        return f"stderr is not one line: {err[:500]!r}"
    if (code == 2) != bool(lines) and not (code == 1 and len(lines) == 1):
        return f"exit code {code} with {err[:500]!r}"
    if any(len(line) > 2100 for line in lines) or not all(c.isprintable() or c == "\n" for c in out + err):
        return f"a line that is too long or acts: {err[:200]!r}"
    new = [path for path in folder.iterdir() if path.name not in before]
    if code == 2 and new:
        return f"refused, and wrote {new[0].name}"
    if any((folder / name).read_bytes() != text for name, text in before.items()):
        return "an input was changed"
    told = out
    for path in new:  # whose names are the user's
        told = told.replace(path.name, "")
    return next(filter(None, (_partial(path) for path in new)), "") or (
        f"not a number on stdout: {out[:2000]!r}" if code == 0 and _NOT_A_NUMBER.search(told) else ""
    )


def _partial(path: Path) -> str:
    """Return what is wrong with an output, "" if nothing."""
    if path.name.startswith("."):
        return f"left {path.name}"
    if path.is_dir() and any(path.iterdir()):
        return ""  # the folder of examples
    if not path.is_file() or not path.stat().st_size:
        return f"{path.name} is no file, or empty"
    if path.suffix in (".csv", ".json", ".toml", ".cir", ".lib"):
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            return f"{path.name} is not text"
        if found := _NOT_A_NUMBER.search(text):
            return f"{found[0]} in {path.name}: {text[max(found.start() - 80, 0) : found.end() + 20]!r}"
        if path.suffix == ".json":
            json.loads(text)
        if path.suffix == ".toml":
            tomllib.loads(text)
    return ""
