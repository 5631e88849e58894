"""The examples travel with the package: they are listed, and copied with their notebooks."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Run, assert_one_line

from ilg_circuit.errors import InputError
from ilg_circuit.front import examples

ROOT = Path(__file__).parents[2]
NAMES = sorted(p.stem for p in (ROOT / "examples").glob("*.py"))


def test_all_are_listed_with_what_they_show(run: Run) -> None:
    outcome = run("examples")
    lines = outcome.out.splitlines()
    assert [line.split()[0] for line in lines[:-1]] == NAMES
    assert all(len(line.split()) > 1 for line in lines)
    assert "ilg-circuit examples NAME" in lines[-1]


def test_one_is_copied_with_its_notebook_and_all_are(run: Run, tmp_path: Path) -> None:
    assert run("examples", NAMES[0], "--out", tmp_path / "one").code == 0
    kept = {p.relative_to(tmp_path / "one").as_posix() for p in (tmp_path / "one").rglob("*.*")}
    assert kept == {f"{NAMES[0]}.py", f"notebooks/{NAMES[0]}.ipynb"}
    assert run("examples", "--out", tmp_path / "all").code == 0
    assert sorted(p.stem for p in (tmp_path / "all").glob("*.py")) == NAMES
    assert sorted(p.stem for p in (tmp_path / "all" / "notebooks").glob("*.ipynb")) == NAMES
    copied = (tmp_path / "all" / f"{NAMES[0]}.py").read_bytes()
    assert copied == (ROOT / "examples" / f"{NAMES[0]}.py").read_bytes()


def test_a_file_that_was_changed_is_replaced_only_by_force(run: Run, tmp_path: Path) -> None:
    mine = tmp_path / f"{NAMES[0]}.py"
    mine.write_text("print('mine')\n")
    outcome = run("examples", NAMES[0], "--out", tmp_path)
    assert_one_line(outcome, "is there, with another content; give --force to replace it, or another --out")
    assert mine.read_text() == "print('mine')\n"
    assert not (tmp_path / "notebooks").exists()
    for options in (("--force",), ()):  # the same content again is no change
        assert run("examples", NAMES[0], "--out", tmp_path, *options).code == 0
    assert "mine" not in mine.read_text()


def test_slips_are_told_in_a_line(run: Run, tmp_path: Path) -> None:
    assert_one_line(run("examples", "soft_arms"), "unknown example 'soft_arms'; perhaps soft_arm")
    (tmp_path / "file").touch()
    assert_one_line(run("examples", NAMES[0], "--out", tmp_path / "file"), "cannot make the folder")


def test_an_installation_without_them_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(examples, "__file__", str(tmp_path / "package" / "front" / "examples.py"))
    with pytest.raises(InputError, match="install the package again"):
        examples.folder()


def test_a_data_file_that_a_script_names_goes_with_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    place = tmp_path / "package" / "examples"
    place.mkdir(parents=True)
    (place / "fit.py").write_text('"""\nA fit\n=====\n"""\n\nread("step.csv")\n')
    (place / "step.csv").write_text("time_s\n")
    (place / "other.csv").write_text("time_s\n")
    monkeypatch.setattr(examples, "folder", lambda: place)
    assert examples.titles() == {"fit": "A fit"}
    files = examples.copy_examples(["fit"], tmp_path / "out")
    assert sorted(path.name for path in files) == ["fit.py", "step.csv"]
