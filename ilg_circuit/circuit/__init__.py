"""Strip -> circuit: one list of elements, written out as a PySpice `Circuit` and stamped by the exact solver.

In: an `Actuator` or its lumped elements. Out: `Netlist`, decks, libraries. May import: the ground floor and `strip`.
"""

from .load import Load
from .netlist import Element, Netlist, Output
from .strip import electrical_netlist, port_netlist, sensor_netlist, strip_netlist

__all__ = [
    "Element",
    "Load",
    "Netlist",
    "Output",
    "electrical_netlist",
    "port_netlist",
    "sensor_netlist",
    "strip_netlist",
]
