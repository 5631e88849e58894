"""Finding ngspice's library, and the one line for those who have none."""

from __future__ import annotations

import ctypes.util
import os
from pathlib import Path

import pytest

from ilg_circuit.errors import IlgError, IlgWarning, MissingLibraryError, SolveError
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


@pytest.fixture
def nothing_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A computer without the library; return the folder that a wheel would carry it in."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(library, "_folders", lambda: iter(()))
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    monkeypatch.setattr(library, "carried_folder", lambda: tmp_path / "carried")
    return tmp_path / "carried"


@pytest.mark.parametrize(
    ("system", "release", "conda", "command"),
    [
        ("linux", {"ID": "debian"}, False, "sudo apt install libngspice0"),
        ("linux", {"ID": "linuxmint", "ID_LIKE": "ubuntu debian"}, False, "sudo apt install libngspice0"),
        ("linux", {"ID": "fedora"}, False, "sudo dnf install libngspice"),
        ("linux", {"ID": "rocky", "ID_LIKE": "rhel centos fedora"}, False, "sudo dnf install libngspice"),
        ("linux", {"ID": "arch"}, False, "sudo pacman -S ngspice"),
        ("linux", {"ID": "opensuse-leap", "ID_LIKE": "suse opensuse"}, False, "sudo zypper install libngspice0"),
        ("linux", {"ID": "nixos"}, False, "conda install -c conda-forge ngspice-lib"),
        ("linux", {}, False, "conda install -c conda-forge ngspice-lib"),
        ("linux", {"ID": "debian"}, True, "conda install -c conda-forge ngspice-lib"),
        ("darwin", {}, False, "brew install libngspice"),
        ("win32", {}, False, "pyspice-post-installation --install-ngspice-dll"),
        ("win32", {}, True, "conda install -c conda-forge ngspice-lib"),
    ],
)
def test_without_any_the_line_says_the_platforms_one_command(
    nothing_found: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    system: str,
    release: dict[str, str],
    conda: bool,
    command: str,
) -> None:
    if conda:
        (tmp_path / "conda-meta").mkdir()
    monkeypatch.setattr(library.sys, "platform", system)
    monkeypatch.setattr(library.sys, "prefix", str(tmp_path))
    monkeypatch.setattr(library.platform, "freedesktop_os_release", lambda: release)
    with pytest.raises(MissingLibraryError, match=f"install it by: {command} \\(or set {VARIABLE}") as caught:
        find_library()
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_a_linux_that_does_not_say_what_it_is_is_told_of_conda(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown() -> dict[str, str]:
        raise OSError("no such file")

    monkeypatch.setattr(library.sys, "platform", "linux")
    monkeypatch.setattr(library.platform, "freedesktop_os_release", unknown)
    assert library.install_command() == "conda install -c conda-forge ngspice-lib"


def test_a_wheels_own_library_comes_last(nothing_found: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nothing_found.mkdir()
    (nothing_found / "libngspice.so.0").touch()
    (nothing_found / "libgomp.so.1").touch()
    assert find_library() == nothing_found / "libngspice.so.0"
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: f"lib{name}.so.0")
    assert find_library() == Path("libngspice.so.0")


def test_what_a_wheel_carries_beside_it_is_loaded_only_where_the_system_lacks_it(
    nothing_found: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing_found.mkdir()
    for name in ("libngspice.so.0", "libgomp.so.1"):
        (nothing_found / name).touch()
    loaded: list[str] = []
    there: list[str] = []

    def load(name: str, mode: int = 0) -> None:
        file = Path(name).name
        if file == "libngspice.so.0" and "libgomp.so.1" not in loaded + there:
            raise OSError("needs libgomp")
        loaded.append(file)

    monkeypatch.setattr(library.ctypes, "CDLL", load)
    assert library.loads(nothing_found / "libngspice.so.0")
    assert loaded == ["libgomp.so.1", "libngspice.so.0"]
    loaded.clear()
    there.append("libgomp.so.1")
    assert library.loads(nothing_found / "libngspice.so.0")
    assert "libgomp.so.1" not in loaded


def test_the_engine_is_the_one_asked_for_else_what_is_there(
    nothing_found: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert library.chosen_engine("ngspice", linear=True) == "ngspice"
    with pytest.warns(
        IlgWarning, match="solved by the exact engine, since ngspice's shared library was not found; inst"
    ):
        assert library.chosen_engine(None, linear=True) == "exact"
    with pytest.raises(MissingLibraryError, match=r"^a nonlinear circuit needs ngspice; .* install it by"):
        library.chosen_engine(None, linear=False)
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: f"lib{name}.so.0")
    assert library.chosen_engine(None, linear=False) == "ngspice"


def test_the_variable_can_hide_every_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "none")
    assert not library.available()
    with pytest.raises(MissingLibraryError, match=f"{VARIABLE} is 'none', which hides ngspice's library; unset it"):
        find_library()


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
