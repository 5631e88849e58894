"""Files are replaced whole or not at all."""

from __future__ import annotations

import json
import math
import os
import stat
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit import files
from ilg_circuit.errors import InputError
from ilg_circuit.files import replacing, require_writable, write_csv, write_json, write_text


def only(folder: Path) -> dict[str, str]:
    """Everything in a folder, hidden files too."""
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def test_written(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "one\ntwo \N{GREEK SMALL LETTER MU}\n")
    assert (tmp_path / "a.txt").read_bytes() == "one\ntwo \N{GREEK SMALL LETTER MU}\n".encode()
    write_text(tmp_path / "a.txt", "three")
    assert only(tmp_path) == {"a.txt": "three"}


@pytest.mark.parametrize("error", [RuntimeError, OSError, KeyboardInterrupt, InputError])
@pytest.mark.parametrize("there", [True, False])
def test_a_failure_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, there: bool, error: type[BaseException]
) -> None:
    path = tmp_path / "a.txt"
    if there:
        path.write_text("old")

    def write() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise error("disk full")

    with pytest.raises((error, InputError)):
        write()
    assert only(tmp_path) == ({"a.txt": "old"} if there else {})


def test_nobody_sees_half_a_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with replacing(path) as temporary:
        temporary.write_text("half")
        assert path.read_text() == "old"
        assert temporary.parent == path.parent  # a rename across file systems would copy
        assert temporary.suffix == path.suffix  # writers judge by it
    assert only(tmp_path) == {"a.txt": "half"}


def test_a_full_disk_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(InputError, match=r"cannot write '.*a\.txt': No space left on device"):
        write_text(tmp_path / "a.txt", "text")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps no such modes")
def test_files_have_the_users_usual_mode(tmp_path: Path) -> None:
    """A temporary file is private; what takes its place must not be."""
    (tmp_path / "usual").touch()
    write_text(tmp_path / "written", "text")
    usual, written = (stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("usual", "written"))
    assert written == usual


def test_folders_are_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it is a folder; give a file name in it"):
        require_writable(tmp_path)
    with pytest.raises(InputError, match=r"folder '.*none' does not exist; create it or choose another"):
        require_writable(tmp_path / "none" / "a.txt")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="does not exist"):
        require_writable(tmp_path / "file" / "a.txt")
    require_writable(tmp_path / "a.txt")
    assert only(tmp_path) == {"file": ""}


def test_an_unwritable_folder_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files.os, "access", lambda path, mode: False)
    with pytest.raises(InputError, match="is not writable; choose another"):
        write_text(tmp_path / "a.txt", "text")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere, Windows has no such modes")
def test_a_really_unwritable_folder(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(InputError, match="is not writable"):
            write_text(tmp_path / "a.txt", "text")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this platform has no named pipes")
def test_a_pipe_or_device_is_never_replaced_by_a_file(tmp_path: Path) -> None:
    """As root, --out /dev/null would otherwise put a regular file in the place of the device."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_text(pipe, "text")
    except InputError:
        pass
    finally:
        os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


@pytest.mark.skipif(os.name == "nt", reason="links need a privilege on Windows")
def test_a_link_is_written_through(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    target, link = tmp_path / "real" / "a.txt", tmp_path / "link.txt"
    target.write_text("old")
    link.symlink_to(target)
    write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_csv_gives_every_bit_back_and_blanks_for_what_is_not_known(tmp_path: Path) -> None:
    values = np.array([0.1 + 0.2, 1e-300, math.nan])
    write_csv(tmp_path / "a.csv", {"x_m": values, "n": [1, None, 3], "what": ["cycle", "at rest", "a, b"]})
    assert (tmp_path / "a.csv").read_bytes() == (
        b'x_m,n,what\n0.30000000000000004,1,cycle\n1e-300,,at rest\n,3,"a, b"\n'
    )
    with pytest.raises(ValueError, match="zip"):
        write_csv(tmp_path / "a.csv", {"x": [1.0], "y": [1.0, 2.0]})
    assert len(list(tmp_path.iterdir())) == 1


def test_json_holds_no_number_that_is_none(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"x": 0.1, "y": None})
    assert json.loads((tmp_path / "a.json").read_text()) == {"x": 0.1, "y": None}
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "a.json", {"x": math.nan})
