"""Makes ngspice's shared library available to this Python, and says what it will do before it does it.

In this order: a library that is already there; Debian's package, as root or with a sudo that asks for no password; the
same package unpacked into the virtual environment, which needs no rights; Homebrew.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from debian_packages import apt_room, last_line, run, unpack

from ilg_circuit.errors import MissingLibraryError
from ilg_circuit.solve.library import VARIABLE, candidates, install_command, loads, private_folder


def main() -> int:
    if found := find():
        print(f"ngspice: found {found}")
        return 0
    problems = []
    for get in (install_with_apt, unpack_with_apt, install_with_brew):
        try:
            done = get()
        except (OSError, subprocess.CalledProcessError) as error:
            problems.append(last_line(error))
            continue
        if done and (found := find()):
            print(f"ngspice: {done}: {found}")
            return 0
    because = f" ({'; '.join(problems)})" if problems else ""
    way = f"install it by: {install_command()} (or let {VARIABLE} name the file)"
    print(f"ngspice: no shared library found{because}: {way}", file=sys.stderr)
    return 1


def find() -> Path | None:
    return next((library for library in candidates() if loads(library)), None)


def install_with_apt() -> str | None:
    if not shutil.which("apt-get"):
        return None
    if os.geteuid() == 0:
        as_root = []
    elif shutil.which("sudo") and subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode == 0:
        as_root = ["sudo", "-n"]
    else:
        return None
    say("there is none here: installing the system's package libngspice0 with apt-get", *as_root)
    apt = [*as_root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-o", "DPkg::Lock::Timeout=60"]
    run(*apt, "update", check=False)  # one unreachable source need not stop the installation
    run(*apt, "install", "-y", "--no-install-recommends", "libngspice0")
    return "installed Debian's package libngspice0"


def unpack_with_apt() -> str | None:
    """Unpack into the virtual environment the libraries that the system lacks."""
    if not (shutil.which("apt-get") and shutil.which("dpkg-deb")):
        return None
    say("there is none here: unpacking Debian's package libngspice0 into .venv, the system stays as it is")
    with apt_room() as (room, apt):
        plan = run(*apt, "install", "--simulate", "--no-install-recommends", "libngspice0")
        # A package with its old version in brackets is installed already.
        missing = re.findall(r"^Inst (\S+) \(", plan, flags=re.MULTILINE)
        unpack(room, apt, *missing)
        # One flat folder of nothing but libraries, links among them included: whatever lies in it can be loaded.
        for path in (room / "root").rglob("lib*.so*"):
            if re.fullmatch(r"lib.+\.so(\.\d+)*", path.name) and path.is_file():
                shutil.copy2(path, room / "kept" / path.name, follow_symlinks=False)
        shutil.rmtree(private_folder(), ignore_errors=True)
        shutil.copytree(room / "kept", private_folder(), symlinks=True)
    return f"unpacked Debian's {', '.join(missing)} without root"


def install_with_brew() -> str | None:
    if not shutil.which("brew"):
        return None
    say("there is none here: installing Homebrew's package libngspice")
    run("brew", "install", "libngspice")
    return "installed Homebrew's libngspice"


def say(what: str, *through: str) -> None:
    """Print what will be done next, before it is done; ``through`` names the program that gives the rights."""
    print(f"ngspice: {what}{f', through {through[0]}' if through else ''}", flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except MissingLibraryError as error:
        sys.exit(f"ngspice: {error}")
