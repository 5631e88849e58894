"""Outputs that would take the place of an input or of one another, in every command and by any name of the file."""

from __future__ import annotations

import os
from pathlib import Path

import click
import pytest
from command import Run, assert_one_line

from ilg_circuit.commands import COMMANDS
from ilg_circuit.commands.paths import Command, OutputFile
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import save_actuator

RECORD = "time_s,voltage_V,current_A,displacement_mm\n0,4,0.01,0\n1,4,0.005,1\n2,4,0.004,2\n"
LOADS = "stretch,stress_kPa\n1.1,1\n1.2,2\n1.3,3\n"
RUN = ("--drive", "step:1V", "--duration", "10s")

#: Every way to name a file that is read: the command with {} for it, beside an output.
READ = {
    "simulate, actuator": ("simulate", "{}", *RUN, "--out"),
    "simulate, drive": ("simulate", "paper", "--drive", "file:{}", "--duration", "2s", "--json"),
    "simulate, compare": ("simulate", "paper", *RUN, "--compare", "{}", "--report"),
    "sense, actuator": ("sense", "{}", "--motion", "step:1mm", "--duration", "1s", "--plot"),
    "sense, motion": ("sense", "paper", "--motion", "file:{}", "--duration", "1s", "--out"),
    "impedance, actuator": ("impedance", "{}", "--out"),
    "netlist, actuator": ("netlist", "{}", "--out"),
    "netlist, drive": ("netlist", "paper", "--drive", "file:{}", "--out"),
    "identify, data": ("identify", "{}", "--json"),
    "identify, second": ("identify", "other.csv", "{}", "--out"),
    "identify, actuator": ("identify", "other.csv", "--actuator", "{}", "--out"),
    "ogden, planar": ("ogden", "--planar", "{}", "--plot"),
    "ogden, actuator": ("ogden", "--planar", "other.csv", "--actuator", "{}", "--out"),
    "cpg, weights": ("cpg", "--weights", "{}", "--duration", "1s", "--out"),
    "arm, actuator": ("arm", "--actuator", "{}", "--duration", "1s", "--out"),
    "sweep, actuator": ("sweep", "{}", "--vary", "width=5mm,6mm", *RUN, "--out"),
    "sweep, drive": ("sweep", "paper", "--vary", "width=5mm,6mm", *RUN[2:], "--drive", "file:{}", "--out"),
    "sweep, designs": ("sweep", "paper", "--designs", "{}", *RUN, "--out"),
    "design, actuator": ("design", "{}", "--require", "force_final>=1mN", "--vary", "width=1mm:9mm", *RUN, "--out"),
    "design, drive": ("design", "paper", *RUN[2:], "--drive", "file:{}", "--out"),
}


@pytest.mark.parametrize("command", READ.values(), ids=READ)
def test_no_output_takes_the_place_of_an_input(run: Run, command: tuple[str, ...]) -> None:
    Path("other.csv").write_text(LOADS if command[0] == "ogden" else RECORD)
    Path("folder").mkdir()
    original = Path("input.csv")
    original.write_text(RECORD)
    Path("link.csv").symlink_to("input.csv")
    os.link("input.csv", "hard.csv")
    ways = {"input.csv": "input.csv", "./folder/../input.csv": "input.csv", "link.csv": "input.csv"}
    for output, given in (*ways.items(), ("hard.csv", "input.csv"), ("input.csv", "link.csv")):
        done = run(*(part.format(given) for part in command), output)
        assert_one_line(done, "name the same file, ", command[-1])
    assert original.read_text() == RECORD
    assert Path("link.csv").is_symlink()
    assert len(list(Path().iterdir())) == 5


TWO = {
    "simulate": ("simulate", "paper", *RUN),
    "sense": ("sense", "paper", "--motion", "step:1mm", "--duration", "1s"),
    "impedance": ("impedance", "paper"),
    "identify": ("identify", "other.csv"),
    "ogden": ("ogden", "--planar", "other.csv", "--actuator", "paper"),
    "cpg": ("cpg", "--duration", "1s"),
    "arm": ("arm", "--duration", "1s"),
    "sweep": ("sweep", "paper", "--vary", "width=5mm,6mm", *RUN),
    "design": ("design", "paper", *RUN),
}


@pytest.mark.parametrize("command", TWO.values(), ids=TWO)
def test_two_outputs_are_two_files(run: Run, command: tuple[str, ...]) -> None:
    Path("other.csv").write_text(RECORD)
    Path("there.pdf").write_text("old")
    os.link("there.pdf", "hard.pdf")
    Path("dangling.pdf").symlink_to("new.pdf")
    for first, second in (("a", "./a"), ("a", "A"), ("there.pdf", "hard.pdf"), ("dangling.pdf", "new.pdf")):
        done = run(*command, "--out", first, "--plot", second)
        assert_one_line(done, "--out", "--plot", "name the same file, ", "give each its own")
    assert Path("there.pdf").read_text() == "old"


def test_a_strip_is_replaced_where_that_is_meant(run: Run) -> None:
    save_actuator(PAPER, "strip.toml")
    Path("planar.csv").write_text(
        "stretch,stress_kPa\n" + "".join(f"{x},{9 * (x - 1)}\n" for x in (1.1, 1.2, 1.3, 1.4))
    )
    command = ("ogden", "--planar", "planar.csv", "--model", "neo-hookean", "--actuator", "strip.toml")
    before = Path("strip.toml").read_text()
    assert_one_line(run(*command, "--out", "strip.toml"), "'strip.toml'; give --force to replace it")
    assert Path("strip.toml").read_text() == before
    run(*command, "--out", "strip.toml", "--force")
    assert Path("strip.toml").read_text() != before
    assert_one_line(run(*command, "--out", "planar.csv", "--force"), "give each its own")


WRONG = {
    "simulate": (TWO["simulate"], "--out", "x.xlsx", "--out writes CSV; end its name in .csv, .txt or .dat"),
    "a table as JSON": (TWO["simulate"], "--json", "x.csv", "--json writes JSON; end its name in .json"),
    "a page": (TWO["impedance"], "--report", "x.pdf", "--report writes HTML; end its name in .html or .htm"),
    "a picture": (TWO["design"], "--plot", "x.gif", "--plot writes a picture; end its name in .png, .pdf or .svg"),
    "a picture of nothing": (TWO["cpg"], "--plot", "x", "--plot writes a picture"),
    "a strip": (TWO["identify"], "--out", "x.json", "--out writes TOML; end its name in .toml"),
    "a sweep": (TWO["sweep"], "--out", "x.xlsx", "--out writes netCDF or CSV; end its name in .nc, .nc4, .h5 or .csv"),
    "a motion": (TWO["arm"], "--out", "x.csv", "--out writes netCDF"),
    "a deck": (TWO["cpg"], "--netlist", "x.lib", "--netlist writes a SPICE deck"),
    "a netlist": (("netlist", "paper"), "--out", "x.txt", "end its name in .cir (a deck) or .lib (a subcircuit)"),
}


@pytest.mark.parametrize(("command", "option", "name", "hint"), WRONG.values(), ids=WRONG)
def test_a_suffix_that_is_not_written_is_refused(
    run: Run, command: tuple[str, ...], option: str, name: str, hint: str
) -> None:
    Path("other.csv").write_text(RECORD)
    assert_one_line(run(*command, option, name), f"'{name}'", hint)
    assert [path.name for path in Path().iterdir()] == ["other.csv"]


def test_a_number_at_the_end_of_a_name_is_no_suffix(run: Run) -> None:
    assert run("impedance", "paper", "--engine", "exact", "--points", "3", "--out", "bias_0.5V").code == 0
    assert Path("bias_0.5V").read_text().startswith("frequency_Hz")


def test_every_command_is_checked() -> None:
    """A new command or output cannot be forgotten: options that name files are of the types that are checked."""
    from importlib import import_module

    for name in COMMANDS:
        command = getattr(import_module(f"ilg_circuit.commands.{name}"), name)
        assert isinstance(command, Command), name
        for option in command.params:
            if isinstance(option.type, click.Path) and "write" in (getattr(option, "help", "") or ""):
                assert isinstance(option.type, OutputFile), (name, option.name)
