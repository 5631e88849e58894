"""The command ``doctor``: versions, the library, and whether a solved step agrees with its closed form."""

from __future__ import annotations

from collections.abc import Iterator

import click

from .. import __version__
from ..errors import MissingLibraryError, SolveError
from .emit import say
from .paths import Command

PACKAGES = ("PySpice", "numpy", "scipy", "lmfit", "matplotlib", "click", "pint", "tqdm")

#: The self-check passes below this difference from the closed form, relative to the maximum.
TOLERANCE = 1e-7


@click.command(cls=Command, examples=("doctor", "doctor > versions.txt"))
def doctor() -> None:
    """Check the installation: versions, ngspice, one solved step."""
    for line in examine():
        say(line)


def examine() -> Iterator[str]:
    """Yield the lines of the report. Raises an IlgError at the first fault; a missing library is the last one."""
    import platform

    import numpy as np

    from ..drive import PiecewiseLinear
    from ..simulation import closed_forms, response
    from ..solve.library import available, carried_folder, find_library, install_hint
    from ..solve.ngspice import session
    from ..strip.actuator import PAPER
    from ..strip.elements import lumped_port

    yield f"ilg-circuit {__version__}, Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    yield ", ".join(f"{name} {_version(name)}" for name in PACKAGES)
    engine = "ngspice" if available() else "exact"
    if engine == "ngspice":
        library = find_library()
        yield f"ngspice library: {library}{' (the one in the wheel)' if carried_folder() in library.parents else ''}"
        yield f"ngspice version: {session().version}"
    else:
        yield "ngspice library: none; linear strips are solved by the exact engine"
    t = np.linspace(0, 300, 601)
    solved = response.simulate(PAPER, PiecewiseLinear.step(4.0), t, beam="static", engine=engine)
    port = lumped_port(PAPER)
    constants = closed_forms.current_constants(port.dc_resistance, port.dynamic_resistance, port.capacitance)
    exact = 4 * closed_forms.current_step(t, *constants)
    difference = float(np.abs(solved.current - exact).max() / exact.max())
    if not difference <= TOLERANCE:
        raise SolveError(
            f"self-check failed: the step current is {difference:.1e} of its maximum away from EC (4) "
            f"(allowed: {TOLERANCE:g}); report the versions above"
        )
    yield f"self-check: 4 V step of the paper's strip within {difference:.1e} of EC (4) (allowed: {TOLERANCE:g})"
    if engine == "exact":
        raise MissingLibraryError(f"nonlinear strips need ngspice; {install_hint()}")


def _version(name: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"
