"""Solves circuits: by ngspice, the engine of record, and by the exact solver of linear circuits that checks it.

In: netlists and a drive. Out: waveforms with a stated error. May import: the top level and `circuit`.
"""

from .transient import Waveforms, transient

__all__ = ["Waveforms", "transient"]
