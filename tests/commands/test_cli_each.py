"""`identify --each`, `watch` and the logs: many files, each fitted by itself; what is finished is not done again."""

from __future__ import annotations

import csv
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
from command import Run, assert_one_line
from synthetic import record, step

import ilg_circuit as ilg
from ilg_circuit.commands import progress
from ilg_circuit.errors import InputError, written
from ilg_circuit.files import MARKER
from ilg_circuit.front.each import FileTask, fit_file, labels
from ilg_circuit.front.watch import watch
from ilg_circuit.report import axes, identification, page
from ilg_circuit.study.workers import processes_possible

FIT = ("--model", "rc", "--engine", "exact", "--onset", "first-level")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders without the picture, pages without pictures; in this process."""
    monkeypatch.setattr(page, "png", lambda figure, dpi: "")
    monkeypatch.setattr(progress, "_LONG", 1e9)  # nothing is said of how long it takes
    monkeypatch.setattr(identification, "figure", lambda fit: axes.blank((1.0, 1.0)))


def write(path: Path, seed: int = 0) -> Path:
    path.parent.mkdir(exist_ok=True, parents=True)
    return record(step(), 300.0, 61, rest=5, noise=1e-3, seed=seed).write(path)


def rows(path: str) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_file_by_itself_and_not_again(run: Run, tmp_path: Path, quick: None) -> None:
    write(Path("a/step.csv"))
    write(Path("b/step.csv"), 1)
    Path("bad.csv").write_text("hello\n")
    call = ("identify", "a/step.csv", "bad.csv", "b/step.csv", "--each", "--jobs", "1", *FIT, "--log", "fits.log")
    done = run(*call)
    assert (done.code, done.err) == (2, "")
    assert done.out.splitlines()[0] == "3 files, each by itself: 2 fitted, 1 failed"
    assert re.search(r"a/step\.csv +rc +\d+\(\d+\) ohm", done.out)
    assert re.search(r"bad\.csv +failed: bad\.csv: no column for time", done.out)
    table = rows("each.fit/table.csv")
    assert [row["file"] for row in table] == ["a/step.csv", "bad.csv", "b/step.csv"]
    assert [row["exit_code"] for row in table] == ["0", "2", "0"]
    assert "no column for time" in table[1]["error"]
    names = ["a-step.csv", "b-step.csv"]
    assert sorted(path.name for path in Path("each.fit").iterdir()) == sorted([*names, MARKER, "table.csv"])
    for name, row in zip(names, (table[0], table[2]), strict=True):
        content = json.loads(Path(f"each.fit/{name}/fit.json").read_text())
        assert float(row["capacitance_F"]) == content["parameters"]["capacitance"]["value"]
        low, high = content["parameters"]["capacitance"]["ci95"]
        assert float(row["capacitance_low_F"]) <= low < high <= float(row["capacitance_high_F"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "bad.csv", "each.fit", "fits.log"]
    # again: one file has changed
    stamps = {name: (Path("each.fit") / name / "fit.json").stat().st_mtime_ns for name in names}
    write(Path("b/step.csv"), 2)
    again = run(*call, "--json", "-")
    kept = {name: (Path("each.fit") / name / "fit.json").stat().st_mtime_ns for name in names}
    assert [kept[name] == stamps[name] for name in names] == [True, False]
    files = json.loads(again.out)["files"]
    assert [file["resumed"] for file in files] == [True, False, False]
    lines = Path("fits.log").read_text().splitlines()
    assert len(lines) == 6
    assert all(re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d\d:\d\d \S+: (fitted|failed): ", line) for line in lines)
    assert sum("by an earlier run" in line for line in lines) == 1
    # another option, another fit
    other = run(*call[:-2], "--until", "200s", "--table", "table.md", "--plot", "each.png")
    assert "by an earlier run" not in other.out
    assert Path("table.md").read_text().count("\n") == 5


@pytest.mark.skipif(not processes_possible(), reason="this machine lets processes share no locks")
def test_on_several_cores_it_is_the_same(run: Run) -> None:
    paths = [write(Path(f"{k}.csv"), k) for k in range(2)]
    found = [ilg.identify_each(paths, model="rc", engine="exact", onset="first-level", jobs=jobs) for jobs in (1, 2)]
    assert found[0].columns()["capacitance_F"] == found[1].columns()["capacitance_F"]
    assert found[1]["1.csv"].parameters["capacitance"] == found[1].files[1].parameters["capacitance"]
    with pytest.raises(InputError, match=r"unknown file '2\.csv'; perhaps"):
        found[1]["2.csv"]


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (("--out", "a.toml"), "--out is for one fit"),
        (("--own", "capacitance"), "--own is for files that are fitted together"),
        (("--model", "rc4"), "choose one of rc, rc2"),
        (("--jobs", "0"), "0 jobs: give 1 to 1024"),
        (("--thickness", "0.5mm"), "are missing"),
        (("--onset", "other.csv=3s"), "'other.csv' is not one of them"),
        (("--onset", "soon"), "--onset soon: write a time such as 4s"),
        (("--until", "16"), "until: '16' has no unit; write it like '16 s'"),
        (("--columns", "volts=U"), "write it like voltage="),
        (("--folder", "mine"), "'mine' was not made by a fit"),
        (("--log", "none/x.log"), "does not exist"),
    ],
)
def test_what_is_wrong_for_all_is_told_at_once(run: Run, arguments: tuple[str, ...], hint: str) -> None:
    write(Path("0.csv"))
    Path("mine").mkdir()
    Path("mine/thesis.tex").write_text("mine")
    assert_one_line(run("identify", "0.csv", "--each", *arguments), hint)
    assert not Path("each.fit").exists()


def test_no_files_one_file_and_files_that_are_not_there(run: Run, quick: None) -> None:
    assert_one_line(run("identify", "--each"), "Missing argument")
    with pytest.raises(InputError, match="no files were given"):
        ilg.identify_each([])
    with pytest.raises(InputError, match="is given twice"):
        ilg.identify_each(["a.csv", "./a.csv"])
    write(Path("0.csv"))
    half = Path("each.fit/.ilg-0123456789abcdef")  # of a worker that was killed
    half.mkdir(parents=True)
    Path("each.fit", MARKER).write_text("{}")
    one = run("identify", "0.csv", "--each", *FIT)
    assert (one.code, one.out.splitlines()[0]) == (0, "1 file, each by itself: 1 fitted")
    assert not half.exists()
    none = run("identify", "0.csv", "none.csv", "--each", *FIT)
    assert none.code == 2
    assert "none.csv  failed: cannot read 'none.csv': No such file" in none.out


def test_folders_are_told_apart(tmp_path: Path) -> None:
    names = ["a/step.csv", "b/step.csv", "c/step.mpt", "c/other.csv", "table.csv.txt"]
    assert labels([tmp_path / name for name in names]) == [
        "a-step.csv",
        "b-step.csv",
        "step.mpt",
        "other",
        "table.csv.txt",
    ]


def test_a_folder_is_watched_until_nothing_comes(run: Run, quick: None) -> None:
    Path("in").mkdir()
    Path("in/bad.csv").write_text("hello\n")

    def arrive() -> None:
        text = write(Path("whole.csv")).read_text()
        for start in range(0, len(text), len(text) // 3 + 1):  # as an instrument writes
            with Path("in/a.csv").open("a") as file:
                file.write(text[start : start + len(text) // 3 + 1])
            time.sleep(0.2)

    writer = threading.Thread(target=arrive)
    writer.start()
    call = ("watch", "in", "--settle", "0.3s", "--idle", "0.4s", "--jobs", "1", *FIT, "--log", "w.log")
    done = run(*call)
    writer.join()
    assert done.code == 2
    assert re.search(r"^in/a\.csv: fitted: model rc, misfit .*; dc_resistance = ", done.out, re.MULTILINE)
    assert [row["exit_code"] for row in rows("in/each.fit/table.csv")] == ["0", "2"]
    assert [line.split(" ", 1)[1].split(": ")[:2] for line in Path("w.log").read_text().splitlines()] == [
        ["in/bad.csv", "failed"],
        ["in/a.csv", "fitted"],
    ]
    Path("in/bad.csv").unlink()
    again = run(*call)
    assert again.code == 0
    assert "1 fitted (1 by an earlier run)" in again.out
    assert_one_line(run("watch", "none"), "'none' is not a folder")
    with pytest.raises(InputError, match="choose one of rc"):
        watch("in", "in/each.fit", model="rc4")


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="this platform has no such signals")
def test_it_is_interrupted_within_a_second(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    program = subprocess.Popen(
        [sys.executable, "-m", "ilg_circuit", "watch", "in"],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert program.stderr is not None
    assert program.stderr.readline().startswith("watching in; ")
    began = time.monotonic()
    program.send_signal(signal.SIGINT)
    assert program.communicate(timeout=30)[1] == "ilg-circuit: interrupted\n"
    assert program.returncode == 130
    assert time.monotonic() - began < 1.0
    assert os.listdir(tmp_path / "in") == []


def test_a_sweep_keeps_a_log(run: Run) -> None:
    vary = ("--vary", "thickness=0.3mm,0.5mm", "--drive", "step:4V", "--duration", "10s")
    for _ in range(2):
        done = run("sweep", "paper", *vary, "--engine", "exact", "--jobs", "1", "--out", "s.nc", "--log", "s.log")
        assert done.code == 0, done.err
    lines = [line.split(" ", 1)[1] for line in Path("s.log").read_text().splitlines()]
    assert lines == ["design 0: solved", "design 1: solved"] * 2


def test_a_worker_writes_arguments_as_the_command_does(tmp_path: Path) -> None:
    path = tmp_path / "pixels.csv"
    path.write_text("time_s,voltage_V,current_mA,displacement_px\n0,0,0,0\n1,4,1,2\n", encoding="utf-8")
    with written({"scale": "--scale"}):
        task: FileTask = pickle.loads(pickle.dumps(FileTask(path, None, {})))
    assert "say the size of one: --scale 0.042mm/px" in fit_file(task).error
    assert "say the size of one: scale='0.042mm/px'" in fit_file(replace(task, spelling={})).error
