"""Workers of a dask cluster for a sweep: a running cluster, or one started on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from .. import __version__
from ..errors import InputError
from .workers import GivenPool, require_processes

_FORMS = "tcp://HOST:PORT of a dask scheduler, or local:4 for four workers on this machine"
#: Longest wait [s] for a scheduler and its first worker.
_PATIENCE = 30


@contextmanager
def cluster_pool(address: str) -> Iterator[GivenPool]:
    """Yield the workers at ``address``: ``tcp://host:port``, or ``local:N``.

    Raises InputError where there are none, or of another version of this package.
    """
    import distributed

    kind, _, number = address.partition(":")
    local = kind == "local" and number.isdecimal() and 1 <= int(number) <= 1024
    if not local and kind not in ("tcp", "tls", "ucx", "ws", "wss"):
        raise InputError(f"cluster '{address}' is not understood; write {_FORMS}")
    library: Any = distributed  # most of it is untyped
    with ExitStack() as stack:
        scheduler = address
        if local:
            require_processes()
            # no dashboard: it would need a port and a web server
            machine = library.LocalCluster(n_workers=int(number), threads_per_worker=1, dashboard_address=None)
            scheduler = stack.enter_context(machine)
        try:
            client = stack.enter_context(library.Client(scheduler, timeout=_PATIENCE))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError) as error:  # TimeoutError is an OSError
            reason = " ".join(str(error).split())[:120]
            raise InputError(f"no cluster with workers at '{address}' within {_PATIENCE} s: {reason}") from None
        _require_same_version(client)
        deaths = (library.scheduler.KilledWorker,)
        yield GivenPool(client.get_executor(pure=False), lambda: sum(client.ncores().values()), deaths)


def _require_same_version(client: Any) -> None:
    """Raise InputError for a cluster whose scheduler or workers lack this package, or have another version of it.

    The scheduler unpickles tasks, too, and other versions may give other results.
    """
    answers = {f"worker {name}": answer for name, answer in client.run(_version, on_error="return").items()}
    try:
        answers["the scheduler"] = client.run_on_scheduler(_version)
    except Exception as error:  # unpickling a function of a missing package may raise anything
        answers["the scheduler"] = error
    for place, answer in answers.items():
        if answer != __version__:
            found = f"version {answer}" if isinstance(answer, str) else f"none of use: {str(answer)[:80]}"
            raise InputError(
                f"{place} of the cluster needs ilg_circuit {__version__} with its extra 'cluster', and has {found}"
            )


def _version() -> str:
    return __version__
