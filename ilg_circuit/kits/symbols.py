"""Symbols of the strip for drawn circuits: KiCad (.kicad_sym) and LTspice (.asy); pins in the library's order."""

from __future__ import annotations

from .subcircuit import NAME, PINS

#: Pin -> side of the box (-1 left, 1 right) and row (0 upper, 1 lower).
_PLACES = {"plus": (-1, 0), "minus": (-1, 1), "tip": (1, 1), "position": (1, 0)}
_ABOUT = "Ionic liquid gel strip: plus, minus volt and ampere; tip 1 V = 1 uN, 1 A = 1 mm/s; position 1 V = 1 mm"


def kicad() -> str:
    """Return a KiCad symbol library (KiCad 7 and later) whose symbol names its SPICE model and pins."""
    font = "(effects (font (size 1.27 1.27)))"
    shown = {"Reference": "X", "Value": NAME}
    pairs = " ".join(f"{k}={pin}" for k, pin in enumerate(PINS, 1))
    hidden = {
        "Footprint": "",
        "Datasheet": "README.md",
        "Description": _ABOUT,
        "Sim.Device": "SUBCKT",
        "Sim.Library": "strip.lib",
        "Sim.Name": NAME,
        "Sim.Pins": pairs,
    }
    lines = ["(kicad_symbol_lib (version 20220914) (generator ilg_circuit)"]
    lines.append(f'  (symbol "{NAME}" (pin_names (offset 1.016)) (in_bom yes) (on_board yes)')
    places = [f"(at 0 {y} 0)" for y in (6.35, -6.35)]
    for (name, value), at in zip(shown.items(), places, strict=True):
        lines.append(f'    (property "{name}" "{value}" {at} {font})')
    for name, value in hidden.items():
        lines.append(f'    (property "{name}" "{value}" (at 0 0 0) {font[:-1]} hide))')
    lines.append(f'    (symbol "{NAME}_0_1"')
    outline = "(stroke (width 0.254) (type default)) (fill (type background))"
    lines.append(f"      (rectangle (start -10.16 5.08) (end 10.16 -5.08) {outline}))")
    lines.append(f'    (symbol "{NAME}_1_1"')
    for number, pin in enumerate(PINS, 1):
        side, row = _PLACES[pin]
        kind = "output" if pin == "position" else "passive"
        at = f"(at {12.7 * side:g} {2.54 - 5.08 * row:g} {0 if side < 0 else 180})"
        text = f'(name "{pin}" {font}) (number "{number}" {font})'
        lines.append(f"      (pin {kind} line {at} (length 2.54) {text})")
    return "\n".join([*lines, "    )", "  )", ")", ""])


def ltspice() -> str:
    """Return an LTspice symbol, which includes ``strip.lib`` by itself."""
    lines = [
        "Version 4",
        "SymbolType CELL",
        "RECTANGLE Normal -80 -48 80 48",
        "WINDOW 0 0 -48 Bottom 2",
        "WINDOW 3 0 48 Top 2",
        f"SYMATTR Value {NAME}",
        "SYMATTR Prefix X",
        "SYMATTR ModelFile strip.lib",
        f"SYMATTR Description {_ABOUT}",
    ]
    for order, pin in enumerate(PINS, 1):
        side, row = _PLACES[pin]
        lines += [
            f"PIN {80 * side} {-32 + 64 * row} {'LEFT' if side < 0 else 'RIGHT'} 8",
            f"PINATTR PinName {pin}",
            f"PINATTR SpiceOrder {order}",
        ]
    return "\n".join([*lines, ""])
