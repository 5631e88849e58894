"""Presents the energy account of a strip: delivered, dissipated, stored."""

from __future__ import annotations

from functools import partial
from itertools import groupby
from operator import itemgetter

import numpy as np

from ..simulation.energy import EnergyAccount
from ..units import format_quantity
from .axes import BLUE, GREY, ORANGE, Axes, Figure, Panels, engineering, new_figure
from .page import Grid, Page, Section, picture

#: Number of elements named in one line.
_NAMED = 5


def summary(account: EnergyAccount) -> str:
    """Return the energies at the end, element by element."""
    lines = [f"energy delivered until the end  {format_quantity(float(account.source[-1]), 'J', 5)}"]
    for how, parts in groupby(_taken(account), key=itemgetter(1)):
        named = [f"{name} {format_quantity(energy, 'J', 4)}" for name, _, energy in parts]
        if len(named) > _NAMED + 1:
            named[_NAMED:] = [f"and {len(named) - _NAMED} more"]
        lines.append(f"  {how:<26} {', '.join(named)}")
    if np.abs(account.mechanical).max() > 0:
        lines.append(
            f"  {'given to the beam':<26} {format_quantity(float(account.mechanical[-1]), 'J', 4)}, at most "
            f"{account.efficiency:.1e} of what was delivered"
        )
    return "\n".join(lines)


def figure(account: EnergyAccount) -> Figure:
    """Return bars of the energies at the end: what each element dissipated (orange) and stored (blue)."""
    figure, (panel,) = new_figure(1, [0.6 + 0.22 * len(_taken(account))])
    _bars(account, panel)
    return figure


def panels(account: EnergyAccount) -> Panels:
    """Return the panel with the bars."""
    return {"energies": partial(_bars, account)}


def headline(account: EnergyAccount) -> str:
    """Return one line: the energy delivered."""
    return f"{format_quantity(float(account.source[-1]), 'J', 5)} delivered in {account.time[-1]:g} s"


def facts(account: EnergyAccount) -> list[tuple[str, str]]:
    """Return the energies dissipated and stored on each side, and the errors of the balances."""
    taken: dict[str, float] = {}
    for _, how, energy in _taken(account):
        taken[how] = taken.get(how, 0.0) + energy
    rows = [(how, format_quantity(energy, "J", 4)) for how, energy in taken.items()]
    return [*rows, ("efficiency", f"{account.efficiency:.1e}"), ("balances closed to", _balance(account))]


def _balance(account: EnergyAccount) -> str:
    return f"{max(account.electrical_imbalance, account.mechanical_imbalance):.1e}"


def _bars(account: EnergyAccount, panel: Axes) -> Axes:
    bars = _taken(account)
    energies = np.array([energy for _, _, energy in bars])
    factor, unit = engineering(energies, "J")
    colours = [ORANGE if how.startswith("dissipated") else BLUE for _, how, _ in bars]
    panel.barh([name for name, _, _ in bars], factor * energies, color=colours)
    panel.axvline(factor * float(account.source[-1]), color=GREY, linewidth=0.8, linestyle="--")
    panel.invert_yaxis()
    panel.set_xlabel(f"energy at the end [{unit}]\norange: dissipated, blue: stored, dashed: delivered")
    return panel


def section(account: EnergyAccount) -> Section:
    """Return the energies at the end as a section of a page."""
    rows = [(name, how, format_quantity(energy, "J", 4)) for name, how, energy in _taken(account)]
    table = Grid(("element", "", "energy at the end"), rows, words=frozenset({0, 1}))
    return Section("Where the energy goes", [table, picture(figure(account), "energies at the end, by element")])


def page(account: EnergyAccount) -> Page:
    """Return the account as a page."""
    delivered = format_quantity(float(account.source[-1]), "J", 5)
    told = [("delivered", delivered), *facts(account)[-2:]]
    return Page("Energy of a strip", "delivered, dissipated, stored", told, (), [section(account)])


def _taken(account: EnergyAccount) -> list[tuple[str, str, float]]:
    """Return (element, how it took energy, energy [J] at the end) for each element that took any."""
    return [
        (name, f"{kind} {side}", float(values[-1]))
        for kind in ("dissipated", "stored")
        for side in ("electrically", "mechanically")
        for name, values in account.parts(kind, mechanical=side == "mechanically").items()
        if np.abs(values).max() > 0
    ]
