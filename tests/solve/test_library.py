"""Finding ngspice's library, and the one line for those who have none."""

from __future__ import annotations

import ctypes.util
import os
from pathlib import Path

import pytest

from ilg_circuit.errors import IlgError, MissingLibraryError, SolveError
from ilg_circuit.solve import library
from ilg_circuit.solve.library import VARIABLE, find_library


def test_the_variable_comes_first(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "my-ngspice.so"
    file.touch()
    monkeypatch.setenv(VARIABLE, str(file))
    assert find_library() == file


def test_a_variable_that_names_nothing_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "none.so"))
    with pytest.raises(MissingLibraryError, match=rf"{VARIABLE} is '.*none\.so', which is not a file") as caught:
        find_library()
    assert "\n" not in str(caught.value)


def test_a_variable_that_names_a_folder_is_no_library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    with pytest.raises(MissingLibraryError, match="which is not a file"):
        find_library()


@pytest.mark.parametrize(
    ("platform", "names"),
    [
        ("linux", ["libngspice.so.0"]),
        ("linux", ["libngspice.so.0", "libngspice.so"]),
        ("darwin", ["libngspice.0.dylib"]),
        ("darwin", ["libngspice.dylib"]),
        ("win32", ["ngspice.dll"]),
        ("win32", ["libngspice-0.dll"]),
    ],
)
def test_names_on_every_platform(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, platform: str, names: list[str]
) -> None:
    for name in names:
        (tmp_path / name).touch()
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(library.sys, "platform", platform)
    monkeypatch.setattr(library, "_folders", lambda: iter([tmp_path / "absent", tmp_path]))
    assert find_library() == tmp_path / names[-1]


def test_without_any_the_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(library, "_folders", lambda: iter(()))
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    with pytest.raises(MissingLibraryError, match="apt install libngspice0") as caught:
        find_library()
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_the_system_is_asked_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(library, "_folders", lambda: iter(()))
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: f"lib{name}.so.0")
    assert find_library() == Path("libngspice.so.0")


@pytest.mark.parametrize("platform", ["linux", "darwin", "win32"])
def test_folders_of_every_platform_can_be_listed(monkeypatch: pytest.MonkeyPatch, platform: str) -> None:
    monkeypatch.setattr(library.sys, "platform", platform)
    folders = list(library._folders())
    assert all(isinstance(folder, Path) for folder in folders)
    assert len(folders) >= 4


def test_prepare_tells_pyspice_where_it_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "libngspice.so.0"
    file.touch()
    monkeypatch.setenv(VARIABLE, "")  # set, so that it is taken back after the test
    monkeypatch.setattr(library, "find_library", lambda: file)
    assert library.prepare_library() == file
    assert os.environ[VARIABLE] == str(file)


def test_a_library_that_cannot_be_loaded_is_no_use(tmp_path: Path) -> None:
    (tmp_path / "libngspice.so").write_text("no library")
    assert not library.loads(tmp_path / "libngspice.so")
    assert library.loads(find_library())


def test_what_lies_unpacked_beside_it_is_loaded_first(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    private = tmp_path / "lib" / "ngspice"
    private.mkdir(parents=True)
    for name in ("libngspice.so.0", "liba.so.1", "libb.so.2"):
        (private / name).touch()
    loaded: list[str] = []

    def load(name: str, mode: int = 0) -> None:
        file = Path(name).name
        if file == "liba.so.1" and "libb.so.2" not in loaded:
            raise OSError("liba needs libb")
        loaded.append(file)

    monkeypatch.setattr(library.sys, "prefix", str(tmp_path))
    monkeypatch.setattr(library.ctypes, "CDLL", load)
    assert library.loads(private / "libngspice.so.0")
    assert loaded == ["libb.so.2", "liba.so.1", "libngspice.so.0"]


def test_a_missing_library_is_a_failed_solve_and_wrong_input() -> None:
    assert issubclass(MissingLibraryError, SolveError)
    assert issubclass(MissingLibraryError, IlgError)
    assert SolveError.exit_code == 1
