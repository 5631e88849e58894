"""What `identify` leaves and prints without being asked for files: the folder, ten lines; tables, and JSON alone."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest
from command import Run, assert_one_line
from synthetic import record, step

import ilg_circuit as ilg
from ilg_circuit.commands import progress
from ilg_circuit.errors import InputError
from ilg_circuit.files import MARKER, replacing_folder
from ilg_circuit.findings import _FIRST, _LAST, SENTENCES, Finding, by_importance
from ilg_circuit.report import axes, identification, page
from ilg_circuit.report.folder import FILES
from ilg_circuit.report.parameter_table import write_table
from ilg_circuit.strip.file import load_actuator

FIT = ("--model", "rc", "--engine", "exact", "--onset", "first-level")
SIZES = ("--length", "36mm", "--free-length", "30mm", "--width", "5mm", "--thickness", "0.5mm")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small empty pictures, and none in pages: they are drawn elsewhere."""
    monkeypatch.setattr(page, "png", lambda figure, dpi: "")
    monkeypatch.setattr(progress, "_LONG", 1e9)  # nothing is said of how long it takes
    monkeypatch.setattr(identification, "figure", lambda fit: axes.blank((1.0, 1.0)))


def write(path: Path, seed: int = 0) -> None:
    path.parent.mkdir(exist_ok=True)
    record(step(), 300.0, 61, rest=5, noise=1e-3, seed=seed).write(path)


def test_alone_it_leaves_a_folder_and_prints_ten_lines(run: Run, tmp_path: Path) -> None:
    write(Path("data/step.csv"))
    done = run("identify", "data/step.csv", *FIT, *SIZES)
    assert done.code == 0, done.err
    folder = Path("data/step.fit")
    assert sorted(path.name for path in folder.iterdir()) == sorted([*FILES, MARKER])
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == sorted([*FILES, MARKER, "step.csv"])
    content = json.loads((folder / "fit.json").read_text())
    assert list(content["provenance"]["inputs"]) == ["data/step.csv"]
    strip = load_actuator(folder / "fitted.toml")
    assert (strip.geometry.length, strip.geometry.width) == (0.036, 0.005)
    assert (folder / "fit.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "parameters.csv").read_text().startswith("parameter,kind,value,stderr")
    lines = done.out.splitlines()
    assert len(lines) + len(done.err.splitlines()) <= 10
    assert "model rc" in lines[0]
    assert re.search(r"dynamic_resistance = \d+\.\d+\(\d+\) ohm", done.out)
    assert "misfit (rms): current 0.1" in done.out
    assert lines[-1].startswith("data/step.fit/: fitted.toml, ")
    assert all(line.startswith("warning: ") for line in done.err.splitlines())
    assert "no Young's modulus was given" in done.err
    # again: replaced as a whole, and -v prints all
    old = (folder / MARKER).stat().st_ino
    verbose = run("identify", "data/step.csv", *FIT, "-v")
    assert "standard error" in verbose.out
    assert (folder / MARKER).stat().st_ino != old
    assert sorted(path.name for path in Path("data").iterdir()) == ["step.csv", "step.fit"]
    # a folder of other files, or with other things in it, is kept
    write(Path("data/step.txt"), seed=3)
    assert "data/step.txt.fit/: " in run("identify", "data/step.txt", *FIT).out
    other = ("identify", "data/step.txt", *FIT, "--folder", "data/step.fit")
    assert_one_line(run(*other), "'data/step.fit' holds the fit of step.csv; name another by --folder")
    (folder / "notes.txt").write_text("mine")
    assert_one_line(run("identify", "data/step.csv", *FIT), "not written by a fit (notes.txt); give --force")
    assert (folder / "notes.txt").read_text() == "mine"
    assert run("identify", "data/step.csv", *FIT, "--force").code == 0
    assert not (folder / "notes.txt").exists()


def test_several_files_have_a_folder_of_the_first(run: Run) -> None:
    for k, name in enumerate(("a/step.csv", "b/step.csv", "a/other.csv")):
        write(Path(name), k)
    for _ in range(2):
        done = run("identify", "a/step.csv", "b/step.csv", *FIT)
        assert done.code == 0, done.err
        assert "a/step.fit/: " in done.out
    assert len((done.out + done.err).splitlines()) <= 10
    assert "a/step+1.fit/: " in run("identify", "a/step.csv", "a/other.csv", *FIT).out


def test_folders_in_the_way(run: Run, tmp_path: Path) -> None:
    write(Path("step.csv"))
    Path("step.fit").mkdir()
    Path("step.fit/thesis.tex").write_text("mine")
    assert_one_line(run("identify", "step.csv", *FIT), "'step.fit' was not made by a fit (thesis.tex); give --force")
    Path("file").write_text("mine")
    assert_one_line(run("identify", "step.csv", *FIT, "--folder", "file"), "give the name of a folder")
    assert_one_line(run("identify", "step.csv", *FIT, "--folder", "none/x"), "does not exist")
    for place in (".", "..", str(tmp_path)):  # not even by force
        done = run("identify", "step.csv", *FIT, "--folder", place, "--force")
        assert_one_line(done, "what is read, or the working folder, is in it")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "step.csv", "step.fit"]


def test_beside_data_that_are_write_protected_it_is_in_the_working_folder(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(Path("data/step.csv"))
    real = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name != "data" and real(path, mode))
    done = run("identify", "data/step.csv", *FIT)
    assert done.code == 0, done.err
    assert "step.fit/: fitted.toml" in done.out
    assert "'data' is write-protected, so it is in the working folder" in done.out
    assert sorted(path.name for path in Path().iterdir()) == ["data", "step.fit"]


def test_files_that_are_asked_for_are_all_there_is(run: Run) -> None:
    write(Path("step.csv"))
    done = run("identify", "step.csv", *FIT, "--json", "-")
    assert done.code == 0
    assert json.loads(done.out)["model"] == "rc"
    assert "95 % interval" in done.err
    assert [path.name for path in Path().iterdir()] == ["step.csv"]
    for name in ("table.tex", "table.md", "table.csv"):
        assert run("identify", "step.csv", *FIT, "--table", name).code == 0
    tex, md = Path("table.tex").read_text(), Path("table.md").read_text()
    assert r"\providecommand{\toprule}{\hline}" in tex
    assert re.search(r"^dynamic\\_resistance & \d+\.\d+\(\d+\) \$\\Omega\$ & .* to .* \\\\$", tex, re.MULTILINE)
    assert tex.count(r"\\") == tex.count("&") // 2
    assert re.search(r"^\| dc_resistance \| [\d.]+\(\d+\) ohm \| .* \|$", md, re.MULTILINE)
    assert not Path("step.fit").exists()


@pytest.mark.parametrize(
    ("arguments", "hints"),
    [
        (("--json", "-", "--table", "-"), ("--table does not write to stdout",)),
        (("--out", "-"), ("--out does not write to stdout",)),
        (("--table", "t.xlsx"), ("end its name in .tex, .csv or .md",)),
        (("--log", "x.log"), ("--log goes with --each",)),
        (("--columns", "voltage=Foo"), ("there is no column 'Foo'",)),
        (("--thickness", "0.5mm"), ("length, free_length, width are missing",)),
        ((*SIZES[:-1], "0.35"), ("thickness: '0.35' has no unit; write it like '0.35 mm'",)),
        (("--model", "rc4"), ("choose one of rc, rc2", "perhaps rc")),
        (("--engine", "exat"), ("perhaps exact",)),
        (("--actuator", "papr"), ("perhaps paper",)),
    ],
)
def test_what_is_refused(run: Run, arguments: tuple[str, ...], hints: tuple[str, ...]) -> None:
    write(Path("step.csv"))
    assert_one_line(run("identify", "step.csv", *arguments), *hints)
    assert [path.name for path in Path().iterdir()] == ["step.csv"]


def test_files_in_each_others_place(run: Run) -> None:
    write(Path("step.csv"))
    assert run("new", "gel.toml", *SIZES).code == 0
    assert_one_line(run("identify", "gel.toml"), "is the file of a strip", "identify DATA.csv --actuator gel.toml")
    done = run("simulate", "step.csv", "--drive", "step:1V", "--duration", "1s")
    assert_one_line(done, "if it is a measurement, fit it first: ilg-circuit identify step.csv", "step.fit/fitted.toml")
    done = run("simulate", "gel.toml", "--drive", "step:1V", "--duration", "1s")
    assert_one_line(done, "identify DATA.csv --actuator gel.toml")


def test_new_writes_what_identify_takes_and_the_name_stays(run: Run) -> None:
    write(Path("step.csv"))
    done = run("new", "gel.toml", *SIZES, "--youngs-modulus", "9kPa")
    assert (done.code, done.err) == (0, "")
    assert_one_line(run("new", "gel.toml", *SIZES), "'gel.toml' exists already; give --force")
    assert run("new", "gel.toml", *SIZES, "--force", "--name", "gel seven").code == 0
    assert run("identify", "step.csv", "--actuator", "gel.toml", *FIT, "--out", "fitted.toml").code == 0
    strip = load_actuator("fitted.toml")
    assert (strip.name, strip.geometry.length) == ("gel seven", 0.036)
    thinner = ("--actuator", "gel.toml", "--thickness", "0.4mm", "--out", "thin.toml")
    assert run("identify", "step.csv", *thinner, *FIT).code == 0
    thin = load_actuator("thin.toml").geometry
    assert (thin.thickness, thin.length) == (0.0004, 0.036)


def test_a_run_that_fails_marks_the_fit_of_an_earlier_one(run: Run) -> None:
    write(Path("step.csv"))
    assert run("identify", "step.csv", *FIT).code == 0
    whole = Path("step.csv").read_text()
    Path("step.csv").write_text("time_s,voltage_V\n0,0\n")
    failed = run("identify", "step.csv", *FIT)
    assert_one_line(failed, "no column for current", "'step.fit' is of an earlier run, see OUTDATED.txt in it")
    assert "no column for current" in Path("step.fit/OUTDATED.txt").read_text()
    Path("step.csv").write_text(whole)
    assert run("identify", "step.csv", *FIT).code == 0
    assert not Path("step.fit/OUTDATED.txt").exists()


def test_from_python(tmp_path: Path) -> None:
    write(tmp_path / "step.csv")
    fit = ilg.identify(tmp_path / "step.csv", model="rc", engine="exact", onset="first-level")
    fit.save(f"{tmp_path}/made/")
    assert sorted(path.name for path in (tmp_path / "made").iterdir()) == sorted([*FILES, MARKER])
    with pytest.raises(InputError, match="was not made by a fit"):
        fit.save(tmp_path)
    with pytest.raises(InputError, match="end its name in"):
        write_table(fit, tmp_path / "table.doc")


def test_a_folder_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "x.fit"
    with replacing_folder(target, {"key": "first"}) as folder:
        (folder / "a").write_text("first")

    def fail() -> None:
        with replacing_folder(target, {}) as folder:
            (folder / "a").write_text("second")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    rename, calls = Path.rename, []

    def failing(self: Path, to: Path) -> Path:
        calls.append(self)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return rename(self, to)

    monkeypatch.setattr(Path, "rename", failing)
    with (
        pytest.raises(InputError, match="No space left on device"),
        replacing_folder(target, {}) as folder,
    ):
        (folder / "a").write_text("third")
    assert [path.name for path in tmp_path.iterdir()] == ["x.fit"]
    assert (target / "a").read_text() == "first"


def test_the_most_important_findings_come_first() -> None:
    assert {*_FIRST, *_LAST} <= SENTENCES.keys()
    told = [Finding("columns-ignored"), Finding("no-actuator"), Finding("contact-lost"), Finding("not-a-success")]
    assert [f.code for f in by_importance(told)] == ["not-a-success", "contact-lost", "no-actuator", "columns-ignored"]
