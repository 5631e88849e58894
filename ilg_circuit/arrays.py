"""The array types that annotations name, and arrays as plain data."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Mask = NDArray[np.bool_]


def plain(values: Array) -> list[float | None]:
    """Return ``values`` (n,) as JSON takes them: None for what is not finite."""
    return [value if np.isfinite(value) else None for value in values.tolist()]
