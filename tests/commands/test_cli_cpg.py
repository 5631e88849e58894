"""`ilg-circuit cpg` as a contract."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from command import Run

from ilg_circuit.provenance import digest


@pytest.fixture
def cpg(run: Run) -> Run:
    """The command ``cpg``."""
    return partial(run, "cpg")


def test_the_contract(cpg: Run) -> None:
    done = cpg("--duration", "20s", "--out", "cpg.csv", "--json")
    assert done.code == 0
    assert done.err == ""
    told = json.loads(done.out)
    assert told["oscillates"] is True
    assert told["period_s"] == pytest.approx(1.035463, abs=5e-7)
    assert told["amplitude"] == pytest.approx(0.462008, abs=5e-7)
    assert told["phase_lags_deg"] == pytest.approx([0, 180])
    header, *lines = Path("cpg.csv").read_text().splitlines()
    assert header == "time_s,neuron_1,neuron_2,output"
    assert lines[-1].startswith("20.0,")


@pytest.mark.parametrize(
    ("options", "neurons", "weight"),
    [
        ([], 2, (0, 1)),
        (["--neurons", "3"], 3, (0, 2)),
        (["--neurons", "3", "--topology", "mutual"], 3, (2, 0)),
        (["--topology", "ring"], 3, (0, 2)),
        (["--topology", "ring", "--neurons", "5"], 5, (0, 4)),
        (["--topology", "one-way-ring"], 3, (0, 2)),
        (["--topology", "chain", "--neurons", "4"], 4, (2, 3)),
    ],
)
def test_wirings(cpg: Run, options: list[str], neurons: int, weight: tuple[int, int]) -> None:
    done = cpg(*options, "--inhibition", "2.75", "--duration", "1s", "--samples", "2", "--json")
    assert done.code == 0, done.err
    network = json.loads(done.out)["network"]
    assert network["neurons"] == neurons
    assert network["weights"][weight[0]][weight[1]] == 2.75
    assert json.loads(done.out)["oscillates"] is True


def test_constants_and_start(cpg: Run) -> None:
    done = cpg(
        *("--adaptation", "2", "--tonic", "3", "--rise-time", "60ms", "--adaptation-time", "0.2s"),
        *("--start", "1,0,0.5,0", "--duration", "1s", "--json"),
    )
    network = json.loads(done.out)["network"]
    assert (network["adaptation"], network["tonic"]) == (2, 3)
    assert (network["rise_time_s"], network["adaptation_time_s"]) == (0.06, 0.2)
    assert network["start"] == [1, 0, 0.5, 0]


def test_weights_from_a_file(cpg: Run) -> None:
    Path("w.csv").write_text("0,0,5\n5,0,0\n0,5,0\n")
    ours = json.loads(cpg("--weights", "w.csv", "--duration", "10s", "--json").out)
    ring = json.loads(cpg("--topology", "one-way-ring", "--inhibition", "5", "--duration", "10s", "--json").out)
    assert ours.pop("provenance")["inputs"] == {"w.csv": digest("w.csv")}
    assert "inputs" not in ring.pop("provenance")
    assert ours == ring


def test_text_picture_and_netlist(cpg: Run) -> None:
    done = cpg("--duration", "5s", "--step", "10ms", "--plot", "cpg.png", "--netlist", "cpg.cir", "--out", "cpg.csv")
    assert done.code == 0
    assert "period        1.035463 s" in done.out
    assert Path("cpg.png").read_bytes().startswith(b"\x89PNG")
    assert "max(0, v(x1))" in Path("cpg.cir").read_text()
    assert len(Path("cpg.csv").read_text().splitlines()) == 502


def test_ngspice(cpg: Run) -> None:
    told = json.loads(cpg("--duration", "2s", "--engine", "ngspice", "--json").out)
    assert told["engine"] == "ngspice"
    assert told["period_s"] == pytest.approx(1.0354632, rel=1e-5)
    assert told["amplitude"] == pytest.approx(0.4620084, rel=1e-5)


def test_a_short_duration_is_a_warning(cpg: Run) -> None:
    done = cpg("--duration", "0.1s", "--json")
    assert done.code == 0
    assert "too short to show one period" in done.err
    assert json.loads(done.out)["warnings"]


def test_sweep(cpg: Run) -> None:
    done = cpg("--sweep", "inhibition=1:5:5", "--out", "sweep.csv", "--plot", "sweep.png")
    assert done.code == 0, done.err
    lines = Path("sweep.csv").read_text().splitlines()
    assert lines[0] == "inhibition,oscillates,period_s,amplitude"
    assert [line.split(",")[1] for line in lines[1:]] == ["0", "1", "1", "", "0"]
    assert Path("sweep.png").exists()
    told = json.loads(cpg("--sweep", "rise-time=50ms:0.2s:4", "--topology", "ring", "--json").out)
    assert [row["rise-time"] for row in told["rows"]] == pytest.approx([0.05, 0.1, 0.15, 0.2])
    assert all(row["outcome"] == "cycle" for row in told["rows"])
    Path("w.csv").write_text("0,2.5\n2.5,0\n")
    assert cpg("--sweep", "tonic=1:2:2", "--weights", "w.csv").code == 0


WRONG = {
    "no duration": ([], "--duration is missing"),
    "no unit": (["--duration", "10"], "--duration: '10' has no unit"),
    "zero duration": (["--duration", "0s"], "duration 0 s must be more than zero"),
    "negative duration": (["--duration", "-1s"], "must be more than zero"),
    "NaN duration": (["--duration", "nans"], "is not a number"),
    "negative time": (["--rise-time", "-0.1s"], "rise_time is -0.1 s; it must be more than zero"),
    "zero time": (["--adaptation-time", "0s"], "adaptation_time is 0 s"),
    "time without unit": (["--rise-time", "0.1"], "has no unit"),
    "NaN inhibition": (["--inhibition", "nan"], "--inhibition': 'nan' is not a number"),
    "NaN tonic": (["--tonic", "nan"], "--tonic': 'nan' is not a number"),
    "negative adaptation": (["--adaptation", "-1"], "adaptation is -1; it must be zero or more"),
    "one neuron": (["--neurons", "1"], "1 neurons: give 2 to 200"),
    "odd chain": (["--topology", "chain", "--neurons", "3"], "give an even number"),
    "topology": (["--topology", "star"], "'mutual', 'ring'"),
    "start": (["--start", "1,2"], "the start has 2 values; 2 neurons need 4"),
    "start text": (["--start", "a,b"], "is not a list of numbers"),
    "start NaN": (["--start", "nan,0,0,0"], "not finite"),
    "couplings": (["--same", "0.1"], "--same belongs to --topology chain"),
    "no file": (["--weights", "none.csv"], "cannot read 'none.csv'"),
    "not square": (["--weights", "flat.csv"], "1 rows of 2 numbers; the weights must be square"),
    "both": (
        ["--weights", "square.csv", "--inhibition", "2"],
        "gives the whole network; leave out --inhibition",
    ),
    "same file": (["--out", "a.csv", "--netlist", "a.csv"], "name the same file"),
    "over the weights": (["--weights", "square.csv", "--out", "square.csv"], "name the same file"),
    "excitation": (["--inhibition", "-9", "--duration", "100s"], "grow without bound"),
    "too long": (["--duration", "1e9s"], "are possible"),
    "folder": (["--out", "none/a.csv"], "does not exist"),
    "picture": (["--plot", "a.gif"], "end its name in .png"),
    "samples": (["--samples", "1"], "1 samples: give 2"),
    "sweep of what": (["--sweep", "colour=1:2:3"], "cannot sweep 'colour'"),
    "sweep": (["--sweep", "tonic=1:2"], "write it like inhibition=1:5:41"),
    "sweep number": (["--sweep", "tonic=a:2:3"], "--sweep tonic: 'a' is not a number"),
    "sweep count": (["--sweep", "tonic=1:2:0"], "is not a number of values"),
    "sweep unit": (["--sweep", "rise-time=1:2:3"], "has no unit"),
    "sweep into the negative": (["--sweep", "rise-time=-1s:1s:3"], "rise_time is -1 s"),
    "sweep with ngspice": (["--sweep", "tonic=1:2:3", "--engine", "ngspice"], "leave out --engine"),
    "sweep of weights": (["--sweep", "inhibition=1:2:3", "--weights", "square.csv"], "belongs to a topology"),
}


@pytest.mark.parametrize(("options", "hint"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_line(cpg: Run, tmp_path: Path, options: list[str], hint: str) -> None:
    Path("flat.csv").write_text("1,2\n")
    Path("square.csv").write_text("0,1\n1,0\n")
    if options and "--duration" not in options and "--sweep" not in options:
        options = [*options, "--duration", "1s"]
    done = cpg(*options)
    assert done.code == 2
    assert done.out == ""
    assert len(done.err.splitlines()) == 1
    assert done.err.startswith("ilg-circuit: ")
    assert hint in done.err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["flat.csv", "square.csv"]
    assert Path("square.csv").read_text() == "0,1\n1,0\n"


def test_a_sweep_takes_no_duration(cpg: Run) -> None:
    assert "leave out --duration" in cpg("--sweep", "tonic=1:2:3", "--duration", "1s").err


def test_the_help_loads_nothing_heavy() -> None:
    code = (
        "import sys\nfrom ilg_circuit.cli import main\n"
        "try:\n    main(['cpg', '--help'])\nexcept SystemExit:\n    pass\n"
        "print('loaded:', sorted({'numpy', 'scipy', 'matplotlib', 'pint', 'tqdm'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[-1] == "loaded: []"
    assert "--inhibition" in done.stdout


def test_neurons_may_feel_a_strip(cpg: Run) -> None:
    felt = ("--strip", "paper", "--reflex", "100", "--inhibition", "4.5")
    done = cpg(*felt, "--duration", "3s", "--out", "felt.csv", "--netlist", "felt.cir", "--json")
    assert done.code == 0
    told = json.loads(done.out)
    assert told["period_s"] == pytest.approx(1.1106949, abs=1e-6)
    assert told["without_reflex"]["outcome"] == "rest"
    assert Path("felt.csv").read_text().startswith("time_s,neuron_1,neuron_2,output,voltage_V,angle_rad,input\n")
    assert "Bangle1 angle1 0" in Path("felt.cir").read_text()
    told = json.loads(cpg(*felt[:2], *felt[4:], "--sweep", "reflex=1000:100:2", "--json").out)
    assert told["rows"][1]["angle_rad"] == pytest.approx(0.00163614, abs=1e-7)
    for line in (
        ("--reflex", "1"),
        ("--entrain", "0.1"),
        ("--strip", "paper", "--entrain", "0.1", "--netlist", "a.cir"),
    ):
        refused = cpg(*line, "--duration", "3s")
        assert refused.code == 2
        assert len(refused.err.splitlines()) == 1
