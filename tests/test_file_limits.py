"""What may be read and written at all: no waiting for pipes, bounded sizes, odd names, full disks, modes that stay."""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command import Run, assert_one_line

from ilg_circuit.errors import InputError, visible
from ilg_circuit.files import locked, read_bytes, replacing, write_text, writing_netcdf

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no such files")


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755])
def test_a_replaced_file_keeps_its_mode(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(mode)
    with replacing(path) as temporary:
        assert stat.S_IMODE(temporary.stat().st_mode) == 0o600, "others must not read it meanwhile"
        temporary.write_text("new")
    assert stat.S_IMODE(path.stat().st_mode) == mode
    assert path.read_text() == "new"


@pytest.mark.skipif(os.name != "nt" and os.geteuid() == 0, reason="nothing is protected from root")
def test_a_protected_file_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    (tmp_path / "a.txt").chmod(0o444)
    with pytest.raises(InputError, match="write-protected"):
        write_text(tmp_path / "a.txt", "new")


@pytest.mark.parametrize(
    ("name", "reason"),
    [("loop", "symbolic links"), ("a" * 300, "too long"), ("file/a", "folder 'file' does not exist")],
    ids=["circle", "long", "file for a folder"],
)
def test_a_path_that_cannot_be(run: Run, name: str, reason: str) -> None:
    Path("loop").symlink_to("loop")
    Path("file").touch()
    assert_one_line(run("impedance", "paper", "--points", "3", "--out", name), "cannot write", reason)
    assert_one_line(run("show", name), "no actuator" if name != "loop" else "cannot read")
    assert_one_line(run("identify", name), "cannot read")
    assert len(list(Path().iterdir())) == 2


READERS = {
    "actuator": ("show", "{}"),
    "data": ("identify", "{}"),
    "drive": ("simulate", "paper", "--drive", "file:{}", "--duration", "10s"),
    "compared": ("simulate", "paper", "--drive", "step:1V", "--duration", "10s", "--compare", "{}"),
    "motion": ("sense", "paper", "--motion", "file:{}", "--duration", "10s"),
    "load test": ("ogden", "--planar", "{}"),
    "weights": ("cpg", "--weights", "{}", "--duration", "1s"),
    "designs": ("sweep", "paper", "--designs", "{}", "--drive", "step:1V", "--duration", "1s", "--out", "s.nc"),
    "arm": ("arm", "--actuator", "{}", "--duration", "1s", "--out", "m.nc"),
    "spared strip": ("ogden", "--planar", "loads.csv", "--actuator", "{}", "--out", "a.toml"),
}


@pytest.mark.parametrize("command", READERS.values(), ids=READERS)
def test_no_reader_waits_or_takes_all_memory(run: Run, command: tuple[str, ...]) -> None:
    Path("loads.csv").write_text("stretch,stress_kPa\n1.1,1\n1.2,2\n1.3,3\n")
    os.mkfifo("pipe")
    for name, reason in (("pipe", "a pipe that nothing is written to"), ("/dev/zero", "device"), (".", "directory")):
        done = run(*(part.format(name) for part in command))
        assert_one_line(done, "cannot read", name, reason if reason != "directory" else "")
    assert sorted(path.name for path in Path().iterdir()) == ["loads.csv", "pipe"]


def test_a_pipe_with_a_writer_is_read(tmp_path: Path) -> None:
    """As a shell's <(...) is."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    text = b"0,2.5\n2.5,0\n" * 10_000  # more than a pipe holds
    keep = os.open(pipe, os.O_RDWR)
    writer = threading.Thread(target=lambda: (pipe.write_bytes(text), os.close(keep)))
    writer.start()
    try:
        assert read_bytes(pipe, 1_000_000, "table") == text
    finally:
        writer.join()


@pytest.mark.parametrize(("size", "fits"), [(0, True), (999, True), (1000, True), (1001, False), (100_000, False)])
def test_a_file_has_a_largest_size(tmp_path: Path, size: int, fits: bool) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"x" * size)
    if fits:
        assert read_bytes(path, 1000, "table") == b"x" * size
    else:
        with pytest.raises(InputError, match=r"a\.txt: larger than 0\.001 MB; that is no table"):
            read_bytes(path, 1000, "table")


ODD = os.fsdecode(b"caf\xe9")  # Latin-1, as old disks have it


def test_names_that_are_not_utf8(run: Run) -> None:
    assert visible(f"{ODD}.csv") == r"caf\xe9.csv"
    try:
        Path(f"{ODD}.csv").write_text("time_s,voltage_V\n0,1\n10,2\n")
    except OSError:
        pytest.skip("this file system has no such names")
    Path(f"{ODD}.d").write_text("thickness_mm\n0.4\n0.5\n")
    assert run("netlist", "paper", "--out", f"{ODD}.cir").code == 0
    files = [f"{ODD}.{kind}" for kind in ("out", "json", "svg", "html")]
    outputs = [part for pair in zip(("--out", "--json", "--plot", "--report"), files, strict=True) for part in pair]
    outputs[1] = f"{ODD}.txt"
    drive = ("--drive", f"file:{ODD}.csv", "--duration", "10s")
    done = run("simulate", "paper", *drive, "--engine", "exact", "--samples", "5", *outputs)
    assert done.code == 0, done.err
    for name in files[1:]:
        assert "caf" in Path(name).read_text(encoding="utf-8")
    sweep = ("sweep", "paper", "--designs", f"{ODD}.d", *drive, "--engine", "exact", "--jobs", "1")
    assert run(*sweep, "--out", f"{ODD}.nc").code == 0
    assert_one_line(run("show", f"{ODD}.toml"), r"no actuator 'caf\xe9.toml'")


@contextmanager
def small_files(size: int) -> Iterator[None]:
    """Files of this process may not grow beyond ``size``: to a program that is a full disk."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("size", [0, 1, 3000, 20_000, 70_000])
def test_a_full_disk_does_not_crash_hdf5(tmp_path: Path, size: int) -> None:
    np = pytest.importorskip("numpy")
    pytest.importorskip("h5netcdf")
    path = tmp_path / "a.nc"

    def write() -> None:
        with writing_netcdf(path) as file:
            file.dimensions = {"x": 10_000}
            for name in "abcde":
                file.create_variable(name, ("x",), dtype="f8")[:] = np.arange(10_000.0)

    with small_files(size), pytest.raises(InputError, match=r"cannot write '.*a\.nc': "):
        write()
    assert list(tmp_path.iterdir()) == []
    write()
    assert path.stat().st_size > 400_000


def test_a_full_disk_is_one_line_for_every_kind_of_file(run: Run) -> None:
    pytest.importorskip("h5netcdf")
    long = ("--drive", "step:1V", "--duration", "10s", "--engine", "exact")
    for command in (
        ("simulate", "paper", *long, "--out", "a.csv"),
        ("simulate", "paper", *long, "--plot", "a.pdf"),
        ("simulate", "paper", *long, "--report", "a.html"),
        ("sweep", "paper", "--vary", "thickness=0.3mm:1mm:9", *long, "--jobs", "1", "--out", "a.nc"),
    ):
        with small_files(500):
            done = run(*command)
        assert done.code == 2
        assert done.err.splitlines()[-1].startswith("ilg-circuit: cannot write '")
        assert "Traceback" not in done.err
        assert list(Path().glob("a.??*")) in ([], [Path("a.nc.part")])


def test_a_name_with_a_null_in_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot write"):
        write_text(tmp_path / "a\0b", "text")
    with pytest.raises(InputError, match="no such file"):
        read_bytes(tmp_path / "a\0b", 10, "table")


def test_a_lock_ends_with_its_holder(tmp_path: Path) -> None:
    path = tmp_path / "a.part" / "lock"
    with locked(path, "taken"):
        assert path.exists()
        with pytest.raises(InputError, match="taken"), locked(path, "taken"):
            raise AssertionError
        assert path.exists()
    assert not path.exists()
    path.write_text("left by a dead process")
    with locked(path, "taken"):
        pass
    assert list(path.parent.iterdir()) == []
