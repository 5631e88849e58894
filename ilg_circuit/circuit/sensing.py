"""A measured law of sensing as elements: R-C filters of the strain, and a source in series with the ions."""

from __future__ import annotations

from ..strip.elements import Elements
from ..strip.geometry import Geometry
from ..strip.sensing import Sensing
from .coupling import BACK
from .load import FORCE_SCALE
from .netlist import GROUND, Element, Role, series_sum

_ROLE = Role.COUPLING_FILTER


def sensing_elements(sensing: Sensing, lumped: Elements, geometry: Geometry) -> list[Element]:
    """Return what puts e = S(s) eps in series with the ion path, below node ``back``.

    The strain is that of the displacement beyond the free one, y - y1 = -F1/K, where F1 is the force at node ``beam``.
    """
    per_force = -FORCE_SCALE / lumped.stiffness * geometry.thickness / geometry.load_distance**2
    elements = [Element("Exs", ("xs", GROUND, "beam", GROUND), per_force, role=_ROLE)]
    terms = [("v(xs)", sensing.instantaneous)] if sensing.instantaneous else []
    for k, mode in enumerate(sensing.relaxations, 1):
        elements.append(Element(f"Rzs{k}", ("xs", f"zs{k}"), mode.time, role=_ROLE))
        elements.append(Element(f"Czs{k}", (f"zs{k}", GROUND), 1.0, role=_ROLE))
        terms.append((f"v(zs{k})", mode.gain))
    made = (Element(e.name, e.nodes, e.value, role=Role.REFLECTION) for e in series_sum("copy", terms))
    return [*elements, *made, BACK]
