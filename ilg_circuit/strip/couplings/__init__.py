"""The registry of couplings: the laws by which a strip bends, by the ``kind`` in the section [coupling] of its file.

voltage               d(s) of the voltage across the ion path, EC (31); also where a file gives no kind
charge                relaxations of the ions' charge over C_ref
voltage-relaxations   relaxations of the voltage across the ion path
"""

from __future__ import annotations

from typing import Any

from ...errors import wrong_choice
from .law import BEAMS as BEAMS
from .law import CouplingLaw as CouplingLaw
from .law import Relaxation as Relaxation
from .relaxing import ChargeCoupling as ChargeCoupling
from .relaxing import RelaxingCoupling as RelaxingCoupling
from .relaxing import VoltageRelaxations as VoltageRelaxations
from .second_order import Coupling as Coupling

#: Couplings by kind; the first is that of a file without one.
COUPLINGS: dict[str, type[CouplingLaw]] = {law.kind: law for law in (Coupling, ChargeCoupling, VoltageRelaxations)}


def coupling_class(kind: Any = Coupling.kind) -> type[CouplingLaw]:
    """Return the class of a coupling's ``kind``. Raises InputError that lists what there is."""
    if not isinstance(kind, str) or kind not in COUPLINGS:
        raise wrong_choice("coupling.kind", str(kind), COUPLINGS)
    return COUPLINGS[kind]
