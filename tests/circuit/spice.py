"""What the tests of netlists share: strips of every electrical model, and ngspice, gnucap and a subcircuit's values."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.strip.actuator import PAPER, Actuator, IonBranch, Mounting

Array = NDArray[np.float64]

NGSPICE, GNUCAP = shutil.which("ngspice"), shutil.which("gnucap")
with_ngspice = pytest.mark.skipif(NGSPICE is None, reason="the program ngspice is not installed")


def _gnucap_runs() -> bool:
    """Whether gnucap is there with its plugins, a package of their own, without which it knows no resistor."""
    if GNUCAP is None:
        return False
    done = subprocess.run([GNUCAP, "-v"], capture_output=True, text=True, timeout=60, check=False, input="")
    return "plugin not found" not in done.stdout + done.stderr


with_gnucap = pytest.mark.skipif(not _gnucap_runs(), reason="the program gnucap, with its plugins, is not installed")


def _strip(name: str, **changes: object) -> Actuator:
    return replace(PAPER, name=name, material=replace(PAPER.material, **changes))


_SECOND, _THIRD = IonBranch(60.0, 0.4), IonBranch(500.0, 0.4)
_RESISTIVE = {"electrode_resistivity_1": 175.0, "electrode_thickness_1": 2e-6}
#: The band is that of a transient of 60 s, and given, so that library and `simulate` take the same ladder.
_BAND = {"ladder_lowest": 1e-3, "ladder_highest": 100.0}

_RANDLES = {
    "interface_resistivity": 4.0,
    "interface_time": 0.3,
    "interface_exponent": 0.8,
    "diffusion_time": 20.0,
    "diffusion_exponent": 0.46,
}

#: One strip of every electrical model, alone and with what goes with it.
MODELS: dict[str, Actuator] = {
    s.name: s
    for s in (
        _strip("rc"),
        _strip("rc2", further_branches=(_SECOND,)),
        _strip("rc3", further_branches=(_SECOND, _THIRD), **_RESISTIVE),
        _strip("warburg", diffusion_time=20.0, **_BAND),
        _strip("cpe", cpe_exponent=0.8, **_BAND),
        _strip("randles", constants=_RANDLES, **_BAND),
        _strip("rc inductance", constants={"inductance": 50.0}),
        _strip("rc sinh", emission_voltage=0.8),
        _strip("rc growing", capacitance_slope=0.3),
        _strip(
            "rc2 growing sinh", further_branches=(_SECOND,), capacitance_slope=0.2, emission_voltage=1.0, **_RESISTIVE
        ),
        _strip("warburg sinh", diffusion_time=20.0, emission_voltage=0.6, **_RESISTIVE, **_BAND),
        _strip("cpe sinh", cpe_exponent=0.6, emission_voltage=2.0, **_BAND),
    )
}
LINEAR = [name for name in MODELS if not re.search("sinh|growing", name)]

#: Strips whose mechanical side differs.
MOUNTED: dict[str, Actuator] = {
    "load inside": replace(PAPER, geometry=replace(PAPER.geometry, load_position=20e-3)),
    "stiff": _strip("stiff", bending_stiffness=1e-8),
    "hanging": replace(_strip("hanging", bending_stiffness=1e-6), mounting=Mounting("hanging")),
    "undamped": _strip("undamped", beam_damping_ratio=0.0),
}


def ngspice(folder: Path, file: str, timeout: float = 60.0, *, raw: str = "", startup: bool = False) -> str:
    """What ``ngspice -b FILE`` prints; fails if ngspice does.

    ``raw`` is a file for all waveforms; with ``startup`` it reads the folder's .spiceinit.
    """
    words = [str(NGSPICE), *(() if startup else ("-n",)), "-b", *(("-r", raw) if raw else ()), file]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=timeout, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def table(path: Path) -> dict[str, Array]:
    """Columns of a file that ngspice's wrdata wrote with one scale and a line of names, in lower case."""
    names = path.read_text(encoding="utf-8").partition("\n")[0].split()
    values = np.loadtxt(path, skiprows=1)
    time, first = np.unique(values[:, 0], return_index=True)
    return {"time": time} | {n.lower(): values[first, k] for k, n in enumerate(names) if k}


def gnucap(folder: Path, file: str) -> list[Array]:
    """The tables that gnucap prints, one for each analysis, one row a time, voltage or frequency."""
    done = subprocess.run([str(GNUCAP), "-b", file], cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    powers = {"": 0, "f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "k": 3, "meg": 6, "g": 9, "t": 12}

    def number(cell: str) -> float:
        match = re.fullmatch(r"(-?\d+\.?\d*(?:e[-+]?\d+)?)([A-Za-z]*)", cell)
        assert match, done.stdout
        return float(match[1]) * 10.0 ** powers[match[2].lower()]

    tables = [part.splitlines()[1:] for part in re.split(r"^#", done.stdout, flags=re.MULTILINE)[1:]]
    found = [[[number(c) for c in row.split()] for row in rows if re.match(r"\s*-?\d", row)] for rows in tables]
    assert all(found), done.stdout + done.stderr
    return [np.array(rows) for rows in found]


def elements(library: str, **given: float) -> dict[str, list[str]]:
    """Element name -> the rest of its line, with every expression worked out for the parameters ``given``, else the
    defaults.
    """
    known: dict[str, float] = {}
    found = {}
    for line in re.sub(r"\n\+ (?![a-z_0-9]+=)", " ", library).splitlines():
        if match := re.fullmatch(r"\+ (\w+)=(\S+)", line):
            known[match[1]] = given.get(match[1], float(match[2]))
        elif match := re.fullmatch(r"\.param (\w+)=\{(.*)\}", line):
            known[match[1]] = _worked_out(match[2], known)
        elif line[0] not in "*.+":
            name, *rest = re.sub(r"\{(.*?)\}", lambda m: repr(_worked_out(m[1], known)), line).split()
            found[name] = rest
    return found


def _worked_out(expression: str, known: dict[str, float]) -> float:
    return float(eval(expression, {"sqrt": math.sqrt, "exp": math.exp, "__builtins__": {}}, known))
