"""Circuit -> waveforms: ngspice, the engine of record, and the exact solver of linear circuits that checks it."""

from .transient import Waveforms, transient

__all__ = ["Waveforms", "transient"]
