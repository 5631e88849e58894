"""The registry of electrical models. A name is an ion path, and after a ``+`` what else: ``rc2``, ``cpe+sinh``.

Ion paths of other packages register themselves by an entry point of the group ``ilg_circuit.models``, an `IonPath`
each; they are loaded when a name or a key of a file is asked for that is not known without them.
"""

from __future__ import annotations

from collections.abc import Iterable, Set
from functools import lru_cache
from importlib.metadata import entry_points

from ...errors import InputError, argument, first_line, wrong_choice
from ...fit.parameter import Parameter
from ..port import Port
from .branches import RC, RC2, RC3, Branches
from .cpe import CPE
from .inductance import INDUCTANCE
from .model import Addition, ElectricalModel, IonPath
from .nonlinear import GROWING, SATURATING, SINH, STERIC
from .randles import RANDLES
from .warburg import WARBURG

ENTRY_POINTS = "ilg_circuit.models"

#: Ion paths by name, in the order in which ``--model auto`` tries them.
MODELS: dict[str, IonPath] = {ions.name: ions for ions in (RC, RC2, RC3, WARBURG, CPE, RANDLES)}
_OWN = frozenset(MODELS)
ADDITIONS: dict[str, Addition] = {a.name: a for a in (SINH, GROWING, INDUCTANCE, SATURATING, STERIC)}


def register(model: IonPath, *, replace: bool = False) -> IonPath:
    """Add an ion path to the registry, and return it; with ``replace`` an existing one of that name is replaced.

    Raises InputError for a name or a set of material keys that is taken, a key that is another's in another unit, or a
    model of the package itself that is to be replaced.
    """
    if not model.name.isidentifier() or model.name in _OWN:
        raise InputError(f"model '{model.name}' cannot be registered: give a word that is not another model's name")
    if model.name in MODELS and not replace:
        raise InputError(
            f"model '{model.name}' is registered already: {argument('replace', True)} puts this one in its place; "
            "or take another name"
        )
    others = [other for name, other in MODELS.items() if name != model.name]
    keys = {p.name: p for p in model.material}
    known = _keys_of(others)
    for other in others:
        if {p.name for p in other.material} == keys.keys():
            raise InputError(
                f"model '{model.name}' has the material keys of '{other.name}': a file could not distinguish them"
            )
    for name, key in keys.items():
        if name in known and known[name].unit != key.unit:
            raise InputError(f"model '{model.name}': material key {name} is in {known[name].unit}, not {key.unit}")
    MODELS[model.name] = model
    return model


def registered() -> list[IonPath]:
    """Return the ion paths from outside the package that are registered."""
    return [model for name, model in MODELS.items() if name not in _OWN]


def electrical_model(name: str) -> ElectricalModel:
    """Return the model of that name. Raises InputError that lists what there is."""
    plain, *added = name.split("+")
    if plain not in MODELS:
        load_entry_points()
    if plain not in MODELS or len(set(added)) < len(added) or any(a not in ADDITIONS for a in added):
        raise wrong_choice("model", name, model_names())
    return composed(MODELS[plain], tuple(sorted(added)))


@lru_cache
def composed(ions: IonPath, additions: tuple[str, ...] = ()) -> ElectricalModel:
    """Return the model of an ion path and additions by name. Raises InputError for those that do not go together."""
    for addition in additions:
        if not ADDITIONS[addition].goes_with(ions):
            fitting = [m.name for m in MODELS.values() if ADDITIONS[addition].goes_with(m)]
            name = "+".join((ions.name, *additions))
            raise InputError(f"model is '{name}'; '{addition}' goes with {', '.join(fitting[:-1])} and {fitting[-1]}")
    laws = [a for a in additions if ADDITIONS[a].charges]
    if len(laws) > 1:
        raise InputError(f"model has {' and '.join(laws)}, two laws of one charge; leave one of them out")
    return ElectricalModel(ions, tuple(ADDITIONS[a] for a in additions))


def model_names() -> tuple[str, ...]:
    """Return every name that `electrical_model` accepts with one addition at most, simple ones first."""
    load_entry_points()
    added = (f"{m.name}+{a.name}" for a in ADDITIONS.values() for m in MODELS.values() if a.goes_with(m))
    return (*MODELS, *added)


def candidates(kind: str) -> tuple[str, ...]:
    """Return the models that ``--model auto`` tries, in order, for data of ``kind``: "record" or "spectrum"."""
    load_entry_points()
    return tuple(m.name for m in MODELS.values() if kind in m.auto)


def ion_path(port: Port) -> IonPath:
    """Return the ion path of a port."""
    return Branches(len(port.branches)) if port.ladder is None else port.ladder.ions


def ion_path_of_material(keys: Set[str], branches: int = 1) -> IonPath:
    """Return the ion path of a material with these ``keys`` of models and this number of branches.

    Raises InputError where there is none, or more than one.
    """
    if not keys:
        return Branches(branches)
    if not keys <= _known_keys().keys():
        load_entry_points()
    found = next((m for m in MODELS.values() if {p.name for p in m.material} == keys), None)
    if found is not None and branches == 1:
        return found
    unknown = sorted(keys - _known_keys().keys())
    if unknown:
        raise InputError(f"material.{unknown[0]} belongs to no electrical model; known are {', '.join(_known_keys())}")
    choices = "; or ".join(", ".join(p.name for p in m.material) for m in MODELS.values() if m.material)
    raise InputError(
        f"material has more than one ion path, or a part of one ({', '.join(sorted(keys))}); give one of "
        f"further_branches; or {choices}"
    )


def material_keys() -> dict[str, Parameter]:
    """Return the keys in [material] of all models and additions, by name."""
    load_entry_points()
    return _known_keys()


def _known_keys() -> dict[str, Parameter]:
    return _keys_of(MODELS.values())


def _keys_of(models: Iterable[IonPath]) -> dict[str, Parameter]:
    keys = {p.name: p for m in models for p in m.material}
    return keys | {a.parameter.name: a.parameter for a in ADDITIONS.values()}


#: Names of the entry points that have been looked at.
loaded: set[str] = set()


def load_entry_points() -> None:
    """Register the ion paths of other packages, once. Raises InputError that names one that cannot be loaded."""
    for entry in entry_points(group=ENTRY_POINTS):
        if entry.name in loaded:
            continue
        loaded.add(entry.name)
        try:
            model = entry.load()
        except Exception as error:  # another package may raise anything
            why = first_line(error)
            raise InputError(f"electrical model '{entry.name}' ({entry.value}) cannot be loaded: {why}") from error
        if not isinstance(model, IonPath):
            raise InputError(f"electrical model '{entry.name}' ({entry.value}) is not an IonPath; see strip.models")
        if MODELS.get(model.name) != model:
            register(model)
