"""The command line as a contract: what is written, what is printed, and how it fails."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
from importlib import import_module
from inspect import cleandoc
from pathlib import Path

import click
import pytest
from command import SIMULATE, Run, assert_one_line

from ilg_circuit import __version__, commands, files
from ilg_circuit.solve.library import VARIABLE
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import dumps


def program(*arguments: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The installed program in a process of its own."""
    code = "import sys; from ilg_circuit.cli import main; main(sys.argv[1:])"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=60,
    )


# -- show --------------------------------------------------------------------------------------------------------------


def test_show(run: Run) -> None:
    done = run("show", "paper")
    assert done.code == 0
    assert done.err == ""
    assert "actuator paper, mounting weightless" in done.out
    assert "666.667 ohm" in done.out
    assert "where the model holds, from 100 uHz to 10 Hz" in done.out


def test_show_json(run: Run) -> None:
    done = run("show", "paper", "--json", "--from", "1mHz", "--to", "1Hz", "--voltage", "-4V")
    told = json.loads(done.out)
    assert done.code == 0
    assert told["elements"]["capacitance"]["value"] == pytest.approx(0.35)
    assert told["band_Hz"] == [1e-3, 1.0]
    assert any("window" in row["assumption"] for row in told["holds"])


def test_show_a_file(run: Run) -> None:
    Path("strip.toml").write_text(dumps(PAPER))
    assert run("show", "strip.toml", "--json").out == run("show", "paper", "--json").out


@pytest.mark.parametrize(
    ("low", "high"), [("1Hz", "1mHz"), ("0Hz", "1Hz"), ("-1Hz", "1Hz"), ("1Hz", "1Hz"), ("1rad/s", "1Hz"), ("1", "2")]
)
def test_show_refuses_a_band_that_is_none(run: Run, low: str, high: str) -> None:
    assert_one_line(run("show", "paper", "--from", low, "--to", high))


# -- netlist, doctor ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["strip.cir", "strip.lib", "strip.sp", "STRIP.CIR"])
def test_netlist(run: Run, name: str) -> None:
    done = run("netlist", "paper", "--out", name)
    assert done.code == 0
    assert done.out == f"wrote {name}\n"
    text = Path(name).read_text()
    assert (".subckt ilg_strip plus minus tip" in text) == name.endswith(".lib")
    assert "ILG strip paper" in text


def test_netlist_takes_the_options_of_simulate(run: Run) -> None:
    done = run(
        *("netlist", "paper", "--drive", "sine:2V,0.1Hz", "--duration", "50s"),
        *("--load", "mass=1g", "--out", "strip.cir"),
    )
    assert done.code == 0, done.err
    text = Path("strip.cir").read_text()
    assert "SIN(0.0 2.0 0.1)" in text
    assert " 50.0 0 " in text


def test_doctor(run: Run) -> None:
    done = run("doctor")
    assert done.code == 0
    assert "ngspice library" in done.out
    assert "self-check" in done.out


# -- help and version --------------------------------------------------------------------------------------------------


def test_version(run: Run) -> None:
    done = run("--version")
    assert done.code == 0
    assert __version__ in done.out


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["show", "--help"], ["simulate", "-h"], ["netlist", "-h"]])
def test_help(run: Run, arguments: list[str]) -> None:
    done = run(*arguments)
    assert done.code == 0
    assert "Usage: ilg-circuit" in done.out


def test_without_a_command_the_help_is_the_answer(run: Run) -> None:
    done = run()
    assert done.code == 2
    assert "Commands:" in done.out + done.err


def test_the_list_of_commands_is_the_commands_own_help() -> None:
    folder = Path(commands.__file__).parent
    modules = {path.stem: import_module(f"ilg_circuit.commands.{path.stem}") for path in folder.glob("[a-z]*.py")}
    found = {name: getattr(module, name, None) for name, module in modules.items()}
    helps = {name: cleandoc(c.help or "") for name, c in found.items() if isinstance(c, click.Command)}
    assert {name: " ".join(text.split("\n\n")[0].split()) for name, text in helps.items()} == commands.COMMANDS
    assert list(commands.COMMANDS) == sorted(commands.COMMANDS)


@pytest.mark.parametrize("arguments", ['["--help"]', '["simulate", "--help"]', '["--version"]'])
def test_help_is_quick(tmp_path: Path, arguments: str) -> None:
    code = f"""
import sys
from ilg_circuit.cli import main
try:
    main({arguments})
except SystemExit:
    pass
heavy = {{"numpy", "scipy", "lmfit", "matplotlib", "pint", "PySpice", "tqdm"}}
commands = {{"ilg_circuit.commands.design", "ilg_circuit.commands.arm"}}
print("loaded:", sorted((heavy | commands) & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "loaded: []"


# -- wrong input -------------------------------------------------------------------------------------------------------

BAD_FILES = {
    "unknown key": ("width =", "colour =", "unknown key 'geometry.colour'"),
    "unknown section": ("[coupling]", "[couplings]", "unknown section 'couplings'"),
    "missing key": ('width = "5 mm"\n', "", "key 'geometry.width' is missing"),
    "missing unit": ('"5 mm"', '"5"', "geometry.width: '5' has no unit"),
    "bare number": ('"5 mm"', "5", "geometry.width = 5 has no unit"),
    "wrong unit": ('"5 mm"', '"5 V"', "geometry.width: unit 'V' does not measure"),
    "hertz": ('rad/s"', 'Hz"', "ambiguous by 2 pi"),
    "negative": ('"5 mm"', '"-5 mm"', "geometry.width is -0.005; it must be more than zero"),
    "NaN": ('"5 mm"', '"nan mm"', "geometry.width: 'nan mm' is not a number"),
    "NaN number": ("0.6212", "nan", "coupling.damping_ratio is nan"),
    "free length": ('"30 mm"', '"36 mm"', "free_length 0.036 m is longer than geometry.length 0.035 m"),
    "no TOML": ("[geometry]", "[geometry", "not valid TOML"),
    "not UTF-8": ("paper", "p\udce9per", "not a text file"),
}


@pytest.mark.parametrize("command", ["show", "simulate", "netlist"])
@pytest.mark.parametrize(("old", "new", "hint"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_wrong_actuator(run: Run, tmp_path: Path, command: str, old: str, new: str, hint: str) -> None:
    text = dumps(PAPER)
    assert old in text
    Path("strip.toml").write_bytes(text.replace(old, new, 1).encode(errors="surrogateescape"))
    options = {"show": [], "simulate": [*SIMULATE[2:], "--out", "run.csv"], "netlist": ["--out", "strip.cir"]}
    assert_one_line(run(command, "strip.toml", *options[command]), "strip.toml: ", hint)
    assert [path.name for path in tmp_path.iterdir()] == ["strip.toml"]


def test_no_such_actuator(run: Run) -> None:
    assert_one_line(run("show", "pper"), "no actuator 'pper': give a TOML file that exists or a preset (paper)")


BAD_OPTIONS = {
    "drive form": (["--drive", "step"], "drive 'step' is not understood"),
    "drive unit": (["--drive", "step:4"], "step: '4' has no unit"),
    "drive NaN": (["--drive", "step:nanV"], "'nanV' is not a number"),
    "drive file": (["--drive", "file:none.csv"], "cannot read 'none.csv'"),
    "duty": (["--drive", "square:4V,3s,2"], "duty 2 must lie between 0 and 1"),
    "duration unit": (["--duration", "300"], "--duration: '300' has no unit"),
    "duration of volts": (["--duration", "300V"], "--duration: unit 'V'"),
    "negative duration": (["--duration", "-300s"], "duration -300 s must be more than zero"),
    "zero duration": (["--duration", "0s"], "duration 0 s must be more than zero"),
    "endless duration": (["--duration", "1e999s"], "--duration"),
    "one sample": (["--samples", "1"], "1 samples: give 2 to 2000000"),
    "text for samples": (["--samples", "many"], "--samples"),
    "step too small": (["--step", "1ns"], "at most 2000000"),
    "step without unit": (["--step", "1"], "--step: '1' has no unit"),
    "step and samples": (["--step", "1s", "--samples", "5"], "not both"),
    "accuracy": (["--accuracy", "1"], "accuracy 1 must lie between"),
    "accuracy NaN": (["--accuracy", "nan"], "'nan' is not a number"),
    "tip": (["--tip", "loose"], "'free', 'clamped'"),
    "engine": (["--engine", "xyce"], "'ngspice', 'exact'"),
    "load key": (["--load", "weight=1g"], "load 'weight=1g' is not understood"),
    "load unit": (["--load", "mass=1m"], "load mass: unit 'm'"),
    "load twice": (["--load", "mass=1g,mass=2g"], "is not understood"),
    "negative load": (["--load", "mass=-1g"], "load mass is -0.001 kg; it must be zero or more"),
    "load on a clamped tip": (["--load", "mass=1g", "--tip", "clamped"], "a load moves with the tip"),
    "load on a static beam": (["--load", "mass=1g", "--beam", "static"], "a load moves with the tip"),
    "unknown option": (["--colour", "red"], "No such option"),
    "picture": (["--plot", "run.gif"], "end its name in .png, .pdf or .svg"),
    "picture's folder": (["--plot", "none/run.png"], "does not exist"),
}


@pytest.mark.parametrize(("options", "hint"), BAD_OPTIONS.values(), ids=BAD_OPTIONS)
def test_wrong_options(run: Run, tmp_path: Path, options: list[str], hint: str) -> None:
    given = dict(zip(options[::2], options[1::2], strict=True))
    arguments = {"--drive": "step:4V", "--duration": "100s", "--out": "run.csv"} | given
    assert_one_line(run("simulate", "paper", *(word for pair in arguments.items() for word in pair)), hint)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", ["--drive", "--duration"])
def test_options_that_must_be_given(run: Run, missing: str) -> None:
    arguments = [w for k, v in (("--drive", "step:4V"), ("--duration", "1s")) if k != missing for w in (k, v)]
    assert_one_line(run("simulate", "paper", *arguments), missing)


def test_unknown_command(run: Run) -> None:
    assert_one_line(run("simulat", "paper"), "simulat")


@pytest.mark.parametrize("out", ["strip.txt", "strip", "strip.lib.bak"])
def test_netlist_needs_a_suffix_it_knows(run: Run, out: str) -> None:
    assert_one_line(run("netlist", "paper", "--out", out), "end its name in .cir")


@pytest.mark.parametrize("duration", ["0s", "-1s", "300"])
def test_netlist_needs_a_duration(run: Run, duration: str) -> None:
    assert_one_line(run("netlist", "paper", "--duration", duration, "--out", "strip.cir"))


# -- output that cannot be written -------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [SIMULATE, ("netlist", "paper")], ids=["simulate", "netlist"])
def test_a_folder_that_is_not_there(run: Run, tmp_path: Path, command: tuple[str, ...]) -> None:
    assert_one_line(run(*command, "--out", "none/a.cir"), "folder 'none' does not exist; create it or choose another")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [SIMULATE, ("netlist", "paper")], ids=["simulate", "netlist"])
def test_a_folder_for_a_file(run: Run, tmp_path: Path, command: tuple[str, ...]) -> None:
    Path("a.cir").mkdir()
    assert_one_line(run(*command, "--out", "a.cir"), "it is a folder; give a file name in it")


def test_an_unwritable_folder_is_told_before_the_work(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files.os, "access", lambda path, mode: False)
    # an actuator that could not be solved: the path comes first
    assert_one_line(run(*SIMULATE, "--out", "run.csv"), "is not writable; choose another")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere, Windows has no such modes")
def test_a_really_unwritable_folder(run: Run, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=stat.S_IRUSR | stat.S_IXUSR)
    assert_one_line(run(*SIMULATE, "--out", "locked/run.csv"), "is not writable")
    assert list(folder.iterdir()) == []


def test_a_failing_picture_leaves_nothing_half_written(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, picture: bytes) -> None:
        path.write_text(str(picture[:9]))
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert_one_line(run(*SIMULATE, "--samples", "3", "--plot", "run.png"), "No space left on device")
    assert list(tmp_path.iterdir()) == []


# -- no ngspice --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [[*SIMULATE, "--out", "run.csv"], ["doctor"]], ids=["simulate", "doctor"])
def test_without_ngspice(tmp_path: Path, arguments: list[str]) -> None:
    done = program(*arguments, cwd=tmp_path, **{VARIABLE: str(tmp_path / "none.so")})
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert f"{VARIABLE} is " in done.stderr
    assert "which is not a file" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [["show", "paper"], ["netlist", "paper", "--out", "a.cir"], [*SIMULATE, "--engine", "exact"], ["--help"]],
    ids=["show", "netlist", "exact", "help"],
)
def test_what_works_without_ngspice(tmp_path: Path, arguments: list[str]) -> None:
    done = program(*arguments, cwd=tmp_path, **{VARIABLE: str(tmp_path / "none.so")})
    assert done.returncode == 0, done.stderr


def test_a_library_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "libngspice.so").write_text("no library")
    done = program(*SIMULATE, cwd=tmp_path, **{VARIABLE: str(tmp_path / "libngspice.so")})
    assert_one_line(done, "cannot load", code=1)


# -- surroundings ------------------------------------------------------------------------------------------------------


def test_failures_of_the_solver_are_exit_code_1(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from ilg_circuit.errors import SolveError
    from ilg_circuit.simulation import response

    def fail(*_: object, **__: object) -> None:
        raise SolveError("ngspice stopped\nat 3 s")

    monkeypatch.setattr(response, "transient", fail)
    assert_one_line(run(*SIMULATE), "ngspice stopped at 3 s", code=1)


def test_an_interrupt_is_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from ilg_circuit.simulation import response

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(response, "transient", interrupt)
    done = run(*SIMULATE)
    assert done.code == 130
    assert "interrupted" in done.err
    assert "Traceback" not in done.err


def test_an_odd_name_on_a_plain_terminal(tmp_path: Path) -> None:
    """A terminal that knows ASCII only must not end in a traceback."""
    text = dumps(PAPER).replace('"paper"', '"gel \N{GREEK SMALL LETTER MU}"')
    (tmp_path / "strip.toml").write_text(text, encoding="utf-8")
    done = program("show", "strip.toml", cwd=tmp_path, PYTHONIOENCODING="ascii", PYTHONUTF8="0", LC_ALL="C")
    assert "Traceback" not in done.stderr
    assert done.returncode == 0


def test_a_hostile_name_runs_nothing(tmp_path: Path) -> None:
    name = "x\\n.control\\nshell touch pwned\\n.endc\\n*"
    (tmp_path / "strip.toml").write_text(dumps(PAPER).replace('"paper"', f'"{name}"'), encoding="utf-8")
    program("simulate", "strip.toml", *SIMULATE[2:], cwd=tmp_path)
    program("netlist", "strip.toml", "--out", "strip.cir", cwd=tmp_path)
    if ngspice := shutil.which("ngspice"):
        subprocess.run([ngspice, "-n", "-b", "strip.cir"], cwd=tmp_path, capture_output=True, timeout=60)
    assert not (tmp_path / "pwned").exists()


def test_a_reader_that_goes_away_is_no_error(tmp_path: Path) -> None:
    code = "import sys; from ilg_circuit.cli import main; main(['show', 'paper'])"
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert b"Traceback" not in process.stderr.read()


def test_no_progress_bar_where_nobody_looks(tmp_path: Path) -> None:
    done = program(*SIMULATE, cwd=tmp_path)
    assert done.returncode == 0
    assert "\r" not in done.stderr


def test_the_installed_program_is_this_one(tmp_path: Path) -> None:
    found = Path(sys.executable).with_name("ilg-circuit.exe" if os.name == "nt" else "ilg-circuit")
    if not found.is_file():
        pytest.skip("the package is imported from its sources, no program is installed beside this Python")
    done = subprocess.run([found, "--version"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True)
    assert __version__ in done.stdout
