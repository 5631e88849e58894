"""Strip -> circuit: one list of elements, written out as a PySpice `Circuit` and stamped by the exact solver."""

from .drive import Drive, PiecewiseLinear, Sine, parse_drive
from .netlist import Element, Netlist, Output
from .strip import Load, electrical_netlist, port_netlist, sensor_netlist, strip_netlist

__all__ = [
    "Drive",
    "Element",
    "Load",
    "Netlist",
    "Output",
    "PiecewiseLinear",
    "Sine",
    "electrical_netlist",
    "parse_drive",
    "port_netlist",
    "sensor_netlist",
    "strip_netlist",
]
