"""Fetches what `ilg-circuit page` puts into its files: ngspice as WebAssembly, and uPlot, by npm.

Each package is fetched by name and version, its archive checked by its hash before anything is taken out of it, and
nothing of it is run. The results go into the package's folder, and from there into wheels, with their licences. Files
that are up to date are left alone. Without npm it says in one line what is missing, and all else works.

python scripts/get_page_assets.py
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

#: Package and version -> its hash, as npm states it.
PACKAGES = {
    "eecircuit-engine@1.8.0": (
        "sha512-surzfC0ZZYRN9X3sRN4w5RqTUypoEArTyMQJTXnBLguH10G+QKLp2LveXHybxyTZPLZVPTfahVw6J8U2caf1vg=="
    ),
    "uplot@1.6.32": "sha512-KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw==",
}
ROOM = Path(__file__).parents[1] / "ilg_circuit" / "browser"
FOLDER = ROOM / "assets"
#: Says what the files were made from: the last one to be written.
STAMP = FOLDER / "made_from.txt"


class Missing(Exception):
    """What is missing, in one line."""


def main() -> int:
    """Fetch what is not up to date; say in one line what was done. 1 where it could not be."""
    try:
        print(f"page: {get()}")
    except Missing as error:
        print(f"page: {error}; ilg-circuit page will say so, all else works", file=sys.stderr)
        return 1
    return 0


def get() -> str:
    """Return what was done. Raises Missing."""
    source = hashlib.sha256(Path(__file__).read_bytes() + (ROOM / "ngspice_licence.txt").read_bytes()).hexdigest()
    wanted = "".join(f"{name} {digest}\n" for name, digest in PACKAGES.items()) + f"by {source}\n"
    if STAMP.is_file() and STAMP.read_text(encoding="utf-8") == wanted:
        return "ngspice for the browser is there"
    npm = shutil.which("npm")
    if npm is None:
        raise Missing("no npm: install it (Debian, Ubuntu: apt-get install npm) and run scripts/get_page_assets.py")
    with tempfile.TemporaryDirectory() as folder:
        engine, plot = (fetched(npm, name, digest, Path(folder)) for name, digest in PACKAGES.items())
    made = ngspice(engine["dist/eecircuit-engine.mjs"].decode("utf-8"))
    made |= {"uplot.js": plot["dist/uPlot.iife.min.js"], "uplot.css": plot["dist/uPlot.min.css"]}
    given = zip(PACKAGES, (engine, plot), strict=True)
    licences = [f"{name}\n\n{files['LICENSE'].decode('utf-8').strip()}\n" for name, files in given]
    licences.append((ROOM / "ngspice_licence.txt").read_text(encoding="utf-8"))
    made["licences.txt"] = "\n\n".join(licences).encode()
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir()
    for name, content in made.items():
        (FOLDER / name).write_bytes(content)
    STAMP.write_text(wanted, encoding="utf-8", newline="\n")
    return f"fetched {' and '.join(PACKAGES)}"


def fetched(npm: str, name: str, digest: str, folder: Path) -> dict[str, bytes]:
    """Return the files of a package's archive by name. Raises Missing where its hash is another one."""
    command = [
        npm,
        "pack",
        name,
        "--silent",
        "--ignore-scripts",
        "--fetch-retries=1",
        "--pack-destination",
        str(folder),
    ]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True, cwd=folder)
    except (OSError, subprocess.CalledProcessError) as error:
        said = str(getattr(error, "stderr", "") or error).strip().splitlines() or ["it gave no reason"]
        raise Missing(f"npm could not fetch {name} ({said[-1]})") from None
    archive = folder / done.stdout.strip().splitlines()[-1]
    found = "sha512-" + base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode("ascii")
    if found != digest:
        raise Missing(f"{name} is another one than expected (its hash is {found})")
    with tarfile.open(archive) as tar:
        members = {member.name.removeprefix("package/"): tar.extractfile(member) for member in tar if member.isfile()}
        return {path: file.read() for path, file in members.items() if file is not None}


def ngspice(module: str) -> dict[str, bytes]:
    """Return ngspice and its loader from the engine's module, without the process models that come with it.

    The loader is a function of a plain script in place of a module, and takes the program from its caller.
    """
    begin, end = module.find("//#region src/spice.js"), module.find("//#region src/readOutput.ts")
    loader = module[begin:end]
    program = re.search(
        r'new URL\("data:application/wasm;base64,([A-Za-z0-9+/=]+)", "" \+ import\.meta\.url\)\.href', loader
    )
    if begin < 0 or end < 0 or program is None or loader.count("async function e(e = {}) {") != 1:
        raise Missing("eecircuit-engine is not built as expected")
    loader = loader.replace(program[0], '""').replace("import.meta.url", '""')
    loader = loader.replace("async function e(e = {}) {", "async function ngspiceModule(e = {}) {")
    return {
        "ngspice.js": loader.encode(),
        "ngspice.wasm.gz": gzip.compress(base64.b64decode(program[1]), 9, mtime=0),
    }


if __name__ == "__main__":
    sys.exit(main())
