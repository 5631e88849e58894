"""A strip whose layers change: what its fitted constants become, and how far the laws of one layer are from that.

A fitted strip's material and coupling are those of the layers that it has. Other layers change them by the ratio of
the layered laws (`ilg_circuit.strip.layers`), so that C, Rd, Rdc, EI and d(s) of the fit are kept for the layers that
were measured. Layers without electrodes say nothing of charge: there the laws of one layer, EC (12)-(14), stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..errors import InputError, nearest
from ..findings import Finding
from .layers import LAYER_FIELDS, Layer, laws

if TYPE_CHECKING:
    from .actuator import Actuator
    from .layers import Storing
    from .material import Material

#: Number r = m' g L0^3/(8 EI) up to which gravity may be neglected: it changes a deflection by less than this.
NEGLIGIBLE_GRAVITY = 0.05
#: Relative change of a size by which exponents are computed.
_STEP = 1e-4
#: Exponents of displacement, force and charge at a voltage with the thickness, by the laws of one layer: EC (14), (37),
#: (39).
ONE_LAYER = {"displacement": -2.0, "force": 1.0, "charge": -1.0}


def split_name(name: str) -> tuple[str, str] | None:
    """Return layer and key of a name such as gel_thickness, None for a name that is none of a layer."""
    endings = (key for key in sorted(LAYER_FIELDS, key=len, reverse=True) if name.endswith(f"_{key}"))
    key = next(endings, None)
    return (name.removesuffix(f"_{key}"), key) if key and len(name) > len(key) + 1 else None


def require_layer(strip: Actuator, name: str) -> tuple[str, str]:
    """Return layer and key of a name such as gel_thickness. Raises InputError where the strip has no such layer."""
    found = split_name(name)
    names = list(dict.fromkeys(layer.name for layer in strip.layers))
    if found is None or found[0] not in names:
        layer = found[0] if found else name
        near = nearest(layer, names)
        known = f"it has {', '.join(names)}" if names else "give its [[layers]]"
        hint = f"perhaps {', '.join(near)}" if near else known
        raise InputError(f"{name}: strip '{strip.name}' has no layer '{layer}'; {hint}")
    return found


def with_layer_values(strip: Actuator, values: Mapping[str, float]) -> Actuator:
    """Return ``strip`` with values such as gel_thickness [SI] changed in all layers of the name."""
    changes: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        layer, key = require_layer(strip, name)
        changes.setdefault(layer, {})[key] = value
    return relayered(strip, [x.with_(**changes.get(x.name, {})) for x in strip.layers])


def with_thickness(strip: Actuator, thickness: float) -> Actuator:
    """Return a layered ``strip`` of another ``thickness`` [m], all layers in proportion."""
    share = thickness / strip.geometry.thickness
    if not share > 0:
        return replace(strip, geometry=replace(strip.geometry, thickness=thickness))  # raises
    return relayered(strip, [x.with_(thickness=share * x.thickness) for x in strip.layers], thickness)


def relayered(strip: Actuator, layers: Sequence[Layer], thickness: float | None = None) -> Actuator:
    """Return ``strip`` with other layers, its constants scaled by the layered laws; see the module.

    ``thickness`` [m] is by default the strip's own, changed by as much as the layers' sum.
    """
    old, new, before = laws(strip.layers), laws(layers), strip.geometry.thickness
    after = before + new.thickness - old.thickness if thickness is None else thickness
    material, coupling = strip.material, strip.coupling
    if material.bending_stiffness is not None:
        material = replace(material, bending_stiffness=material.bending_stiffness * new.stiffness / old.stiffness)
    if new.storing and old.storing:
        material = _scaled(material, old.storing, new.storing, after / before)
        if coupling is not None:
            bent = new.storing.per_volt / old.storing.per_volt
            coupling = coupling.scaled((after / before) ** 2 * bent)
    geometry = replace(strip.geometry, thickness=after)
    return replace(strip, geometry=geometry, material=material, coupling=coupling, layers=tuple(layers))


def _scaled(material: Material, old: Storing, new: Storing, thicker: float) -> Material:
    """Return ``material`` with the electrical constants of other layers; ``thicker`` is the ratio of thicknesses."""
    diffusion = material.diffusion_time is not None
    ions = new.ions(diffusion=diffusion) / old.ions(diffusion=diffusion) / thicker
    charge = new.capacitance / old.capacitance * thicker
    by_unit = {"ohm m": ions, "F/m": charge}
    keys = material.model.material_keys
    constants = {name: value * by_unit.get(keys[name].unit, 1.0) for name, value in dict(material.constants).items()}
    changes: dict[str, Any] = {
        "dc_resistivity": material.dc_resistivity * new.leak / old.leak / thicker,
        "dynamic_resistivity": material.dynamic_resistivity * ions,
        "permittivity": material.permittivity * charge,
        "further_branches": tuple(
            replace(b, dynamic_resistivity=b.dynamic_resistivity * ions, permittivity=b.permittivity * charge)
            for b in material.further_branches
        ),
        "constants": constants,
    }
    if material.diffusion_time is not None:
        slower = new.diffusion_time / old.diffusion_time if old.diffusion_time and new.diffusion_time else 1.0
        changes["diffusion_time"] = material.diffusion_time * slower
    return replace(material, **changes)


@dataclass(frozen=True)
class Scaling:
    """Exponents of displacement, force and charge at a voltage with the strip's thickness, as ``varied`` changes it."""

    law: str
    varied: str
    displacement: float
    force: float
    charge: float


def scalings(strip: Actuator) -> list[Scaling]:
    """Return how a strip answers to its thickness: by the laws of one layer, and by those of its layers."""
    rows = [Scaling("one layer", "thickness", **ONE_LAYER)]
    if not strip.layers or laws(strip.layers).storing is None:
        return rows
    first, last = (k for k, x in enumerate(strip.layers) if x.capacitance_per_volume is not None)
    between = {x.name for x in strip.layers[first + 1 : last]}
    for varied, names in [("thickness", None), *((f"{name}_thickness", {name}) for name in sorted(between))]:
        rows.append(Scaling("layers", varied, **_exponents(strip.layers, names)))
    return rows


def _exponents(layers: Sequence[Layer], names: set[str] | None) -> dict[str, float]:
    """Return the exponents with the whole thickness, as the layers of some ``names`` change, or all."""

    def at(factor: float) -> dict[str, float]:
        some = [x.with_(thickness=factor * x.thickness) if names is None or x.name in names else x for x in layers]
        made = laws(some)
        assert made.storing is not None
        bent, charge = made.storing.per_volt, made.storing.capacitance
        values = {"displacement": bent, "force": bent * made.stiffness, "charge": charge}
        return {"thickness": made.thickness} | values

    low, high = at(1 - _STEP), at(1 + _STEP)
    thicker = math.log(high.pop("thickness") / low.pop("thickness"))
    return {name: math.log(high[name] / low[name]) / thicker + 0.0 for name in high}


@dataclass(frozen=True)
class GravityScope:
    """Sizes from which gravity may be neglected: its number ``r`` is `NEGLIGIBLE_GRAVITY` at most.

    ``longest`` free length [m] at this thickness; ``thinnest`` strip [m] at this length, all layers in proportion;
    ``thinnest_gel`` [m] at this length with the other layers as they are, 0 for any gel, None without such layers.
    """

    law: str
    r: float
    longest: float
    thinnest: float
    thinnest_gel: float | None = None


def gravity_scope(strip: Actuator) -> list[GravityScope]:
    """Return over which sizes gravity may be neglected, with the strip's layers and without them: of gel alone."""
    from .elements import GRAVITY, gravity_ratio

    g = strip.geometry

    def scope(law: str, r: float, gel: float | None = None) -> GravityScope:
        small = NEGLIGIBLE_GRAVITY / r
        return GravityScope(law, r, g.free_length * small ** (1 / 3), g.thickness / math.sqrt(small), gel)

    own = gravity_ratio(strip)
    if not strip.layers:
        return [scope("EI as given" if strip.material.bending_stiffness is not None else "one layer of E", own)]
    gel = gel_of(strip.layers)
    alone = gel.density * GRAVITY * g.free_length**3 / (8 * gel.modulus * g.thickness**2 / 12)
    rows = [scope(f"{gel.name} alone", alone)]
    if len(strip.layers) == 1:
        return rows
    ends = [k for k, x in enumerate(strip.layers) if x.name == gel.name]
    whole = sum(strip.layers[k].thickness for k in ends)

    def excess(factor: float) -> float:
        made = with_layer_values(strip, {f"{gel.name}_thickness": factor * gel.thickness})
        return math.log(gravity_ratio(made) / NEGLIGIBLE_GRAVITY)

    return [*rows, scope("layers", own, _least(excess) * whole if len(ends) == 1 else None)]


def _least(excess: Callable[[float], float]) -> float:
    """Return the least factor at which a falling ``excess`` is zero; 0 where it is negative for any, inf for none."""
    from scipy.optimize import brentq

    low, high = 1e-3, 1e3
    if excess(low) <= 0:
        return 0.0
    if excess(high) > 0:
        return math.inf
    return math.exp(brentq(lambda x: excess(math.exp(x)), math.log(low), math.log(high), xtol=1e-10))


def gel_of(layers: Sequence[Layer]) -> Layer:
    """Return the thickest layer between the electrodes, or of all where none stores charge."""
    places = [k for k, x in enumerate(layers) if x.capacitance_per_volume is not None]
    between = layers[places[0] + 1 : places[1]] if len(places) == 2 else layers
    return max(between, key=lambda x: x.thickness)


def thickness_findings(strip: Actuator, varied: Mapping[str, Iterable[float]]) -> tuple[Finding, ...]:
    """Return a finding where a strip's ``thickness`` is among the ``varied`` [SI] and no layers say how it scales.

    It has the largest factor between the two laws: displacement goes as b^-2 by EC (37), as b^-1 by electrodes whose
    carbon keeps its share of the thickness, charge as b^-1 or as b.
    """
    values = [float(x) for x in varied.get("thickness", ()) if math.isfinite(x) and x > 0]
    if not values or (strip.layers and laws(strip.layers).storing):
        return ()
    own = strip.geometry.thickness
    factor = max(max(values) / own, own / min(values))
    if factor <= 1:
        return ()
    return (Finding("thickness-of-one-layer", values={"own": own, "factor": factor}),)
