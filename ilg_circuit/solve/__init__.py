"""Circuit -> waveforms: ngspice, the engine of record, and the exact solver of linear circuits that checks it.

In: netlists and a drive. Out: waveforms with a stated error. May import: the ground floor and `circuit`.
"""

from .transient import Waveforms, transient

__all__ = ["Waveforms", "transient"]
