"""numba's compiler for the arm's kernels: typed for mypy, cached on disk, never stale.

The first call after an installation compiles, for half a minute or so; later processes load the result.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]
Function = TypeVar("Function", bound=Callable[..., object])


def _drop_stale() -> None:
    """Delete compiled kernels that are older than any source file beside this one.

    numba looks only at the file of the compiled function itself, not at those of the functions that it calls.
    """
    folder = Path(__file__).parent
    newest = max(path.stat().st_mtime for path in folder.glob("*.py"))
    for index in (folder / "__pycache__").glob("*.nbi"):
        with suppress(OSError):
            if index.stat().st_mtime < newest:
                index.unlink()


_drop_stale()


def compiled(function: Function) -> Function:
    """Return ``function`` in machine code. No fast-math: the kernels watch for values that are not finite."""
    compile_later: Any = numba.njit(cache=True, nogil=True, error_model="numpy")
    result: Function = compile_later(function)
    return result


def compiled_loosely(function: Function) -> Function:
    """Return ``function`` as `compiled`; sums may be reordered and vectorised."""
    compile_later: Any = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"})
    result: Function = compile_later(function)
    return result
