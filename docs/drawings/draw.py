"""Draws the explanation's figures: `python docs/drawings/draw.py` writes the SVG files beside this script.

Lines take the page's text colour, so that they are readable on light and dark; the few accents are of Okabe and Ito's
palette and never carry the meaning alone.
"""

from __future__ import annotations

from pathlib import Path

BLUE, ORANGE = "var(--ilg-blue, #0072b2)", "var(--ilg-orange, #d55e00)"


def line(*points: tuple[float, float], color: str = "currentColor", width: float = 2, dash: str = "") -> str:
    """Return a line through points."""
    way = " ".join(f"{x:g},{y:g}" for x, y in points)
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    return f'<polyline points="{way}" fill="none" style="stroke:{color}" stroke-width="{width:g}"{dashes}/>'


def text(x: float, y: float, words: str, anchor: str = "middle", size: int = 17, color: str = "currentColor") -> str:
    """Return words at a place; ``_`` before a letter or a group in braces makes it a subscript."""
    shown, rest = "", words
    while "_" in rest:
        before, _, rest = rest.partition("_")
        low, rest = rest[1:].split("}", 1) if rest.startswith("{") else (rest[0], rest[1:])
        shown += f'{before}<tspan dy="4" font-size="{size - 5}">{low}</tspan><tspan dy="-4">&#8203;</tspan>'
    return (
        f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" font-size="{size}" style="fill:{color}">{shown}{rest}</text>'
    )


def arrow(x: float, y: float, to_x: float, to_y: float, color: str = "currentColor", both: bool = False) -> str:
    """Return an arrow, with heads at both ends where asked for."""
    start = ' marker-start="url(#head)"' if both else ""
    return (
        f'<line x1="{x:g}" y1="{y:g}" x2="{to_x:g}" y2="{to_y:g}" style="stroke:{color}" stroke-width="1.6" '
        f'marker-end="url(#head)"{start}/>'
    )


def resistor(x: float, y: float, label: str, across: bool = True) -> str:
    """Return a resistor of length 60 that begins at a place, along x or along y."""
    box = (x, y - 9, 60, 18) if across else (x - 9, y, 18, 60)
    place = (x + 30, y - 17, "middle") if across else (x + 17, y + 36, "start")
    return (
        f'<rect x="{box[0]:g}" y="{box[1]:g}" width="{box[2]}" height="{box[3]}" fill="none" stroke="currentColor" '
        f'stroke-width="2"/>{text(place[0], place[1], label, place[2])}'
    )


def capacitor(x: float, y: float, label: str, across: bool = True) -> str:
    """Return a capacitor of length 60 that begins at a place, along x or along y."""
    if across:
        return "".join(
            (
                line((x, y), (x + 25, y)),
                line((x + 25, y - 15), (x + 25, y + 15)),
                line((x + 35, y - 15), (x + 35, y + 15)),
                line((x + 35, y), (x + 60, y)),
                text(x + 30, y - 22, label),
            )
        )
    return "".join(
        (
            line((x, y), (x, y + 25)),
            line((x - 15, y + 25), (x + 15, y + 25)),
            line((x - 15, y + 35), (x + 15, y + 35)),
            line((x, y + 35), (x, y + 60)),
            text(x + 22, y + 36, label, "start"),
        )
    )


def inductor(x: float, y: float, label: str) -> str:
    """Return an inductor of length 60 along x."""
    way = f"M{x:g},{y:g}" + " a7.5,9 0 0 1 15,0" * 4
    return f'<path d="{way}" fill="none" stroke="currentColor" stroke-width="2"/>{text(x + 30, y - 17, label)}'


def source(x: float, y: float, label: str) -> str:
    """Return a voltage source of height 60 that begins at a place, along y."""
    return (
        f'{line((x, y), (x, y + 10))}<circle cx="{x:g}" cy="{y + 30:g}" r="20" fill="none" stroke="currentColor" '
        f'stroke-width="2"/>{line((x, y + 50), (x, y + 60))}{text(x - 32, y + 36, label)}'
        f"{text(x, y + 27, '+', size=15)}{text(x, y + 44, '−', size=15)}"
    )


def terminal(x: float, y: float) -> str:
    """Return an open terminal."""
    return f'<circle cx="{x:g}" cy="{y:g}" r="4" fill="none" stroke="currentColor" stroke-width="2"/>'


def strip() -> tuple[str, str, int, list[str]]:
    """Return the strip in its clamp, seen from its side."""
    bent = "M150,150 C290,150 420,135 560,70"
    return (
        "The strip in its clamp",
        "A strip seen from its side. The clamp holds its left end and is its electrical contact. Dashed: at rest. "
        "Under a voltage the free part, of length L0, bends towards the anode; the displacement y is taken at L_F.",
        260,
        [
            *(line((60 + 14 * k, 118), (72 + 14 * k, 104), width=1.2) for k in range(6)),
            *(line((60 + 14 * k, 196), (72 + 14 * k, 182), width=1.2) for k in range(6)),
            f'<rect x="56" y="118" width="94" height="18" fill="none" style="stroke:{BLUE}" stroke-width="3"/>',
            f'<rect x="56" y="164" width="94" height="18" fill="none" style="stroke:{ORANGE}" stroke-width="3"/>',
            line((60, 150), (150, 150), width=14),
            line((150, 150), (566, 150), width=1.4, dash="7 5"),
            f'<path d="{bent}" fill="none" stroke="currentColor" stroke-width="14"/>',
            text(30, 133, "+", size=22, color=BLUE),
            text(30, 180, "−", size=22, color=ORANGE),
            text(36, 96, "clamp", "start"),
            arrow(560, 148, 560, 84),
            text(576, 122, "y", "start"),
            arrow(152, 214, 558, 214, both=True),
            text(355, 234, "L_0  free length (here L_F = L_0)"),
            arrow(58, 250, 558, 250, both=True),
            text(110, 243, "L"),
            arrow(330, 96, 330, 130),
            arrow(330, 188, 330, 154),
            text(330, 84, "b  thickness (width w into the page)", size=15),
            text(640, 60, "towards"),
            text(640, 80, "the anode"),
        ],
    )


def circuit() -> tuple[str, str, int, list[str]]:
    """Return the equivalent circuit of the terminals."""
    return (
        "Equivalent circuit of the terminals",
        "A voltage source u drives the electrode resistance Re, in series with two parallel paths: Rdc for the "
        "electrons, and Rd in series with C for the ions.",
        250,
        [
            line((100, 100), (100, 40), (160, 40)),
            source(100, 100, "u"),
            line((100, 160), (100, 220), (520, 220)),
            resistor(160, 40, "R_e"),
            arrow(250, 40, 290, 40),
            text(268, 30, "i"),
            line((220, 40), (520, 40)),
            line((360, 40), (360, 100)),
            resistor(360, 100, "R_{dc}", across=False),
            line((360, 160), (360, 220)),
            line((520, 40), (520, 60)),
            resistor(520, 60, "R_d", across=False),
            line((520, 120), (520, 136)),
            capacitor(520, 136, "C", across=False),
            line((520, 196), (520, 220)),
            text(300, 190, "electrons", color=ORANGE),
            text(580, 215, "ions", "start", color=BLUE),
        ],
    )


def transformer() -> tuple[str, str, int, list[str]]:
    """Return the transformer analogue."""
    return (
        "Transformer analogue",
        "On the left the electrical port: u, Rdc across it, and Zp = Rd + 1/(C s) in series with a transformer of "
        "ratio N. On the right the mechanical side, where force is a voltage and velocity a current: the stiffness K "
        "as a capacitor 1/K, the mass m as an inductor with the damping Rm, and the tip's terminals F and v.",
        260,
        [
            terminal(60, 50),
            terminal(60, 210),
            text(36, 136, "u"),
            arrow(74, 50, 106, 50),
            text(90, 40, "i"),
            line((64, 50), (190, 50)),
            line((64, 210), (290, 210)),
            line((140, 50), (140, 100)),
            resistor(140, 100, "R_{dc}", across=False),
            line((140, 160), (140, 210)),
            resistor(190, 50, "Z_p = R_d + 1/(C s)"),
            line((250, 50), (290, 50)),
            arrow(256, 50, 282, 50, BLUE),
            text(270, 78, "i_1", color=BLUE),
            *(
                f'<path d="M290,{50 + 20 * k} a10,10 0 0 1 0,20" fill="none" stroke="currentColor" stroke-width="2"/>'
                for k in range(8)
            ),
            *(
                f'<path d="M340,{50 + 20 * k} a10,10 0 0 0 0,20" fill="none" stroke="currentColor" stroke-width="2"/>'
                for k in range(8)
            ),
            line((311, 50), (311, 210), width=1.4),
            line((319, 50), (319, 210), width=1.4),
            text(315, 238, "N(s)"),
            line((340, 50), (480, 50)),
            line((340, 210), (680, 210)),
            arrow(350, 50, 384, 50, ORANGE),
            text(368, 78, "v_1", color=ORANGE),
            line((430, 50), (430, 100)),
            capacitor(430, 100, "1/K", across=False),
            line((430, 160), (430, 210)),
            inductor(480, 50, "m"),
            line((540, 50), (560, 50)),
            resistor(560, 50, "R_m"),
            line((620, 50), (676, 50)),
            terminal(680, 50),
            terminal(684, 210),
            arrow(666, 66, 630, 66),
            text(648, 88, "v"),
            text(704, 136, "F"),
            text(170, 254, "electrical: volt, ampere", size=15, color=BLUE),
            text(530, 254, "mechanical: force = voltage, velocity = current", size=15, color=ORANGE),
        ],
    )


def two_port() -> tuple[str, str, int, list[str]]:
    """Return the strip as a two-port."""
    return (
        "The strip as a two-port",
        "A box with the electrical terminals u, i on its left and the mechanical ones F, v on its right. Driven from "
        "the left with a load on the right it is an actuator; moved from the right it is a sensor. Both share N.",
        220,
        [
            '<rect x="250" y="50" width="240" height="130" rx="8" fill="none" stroke="currentColor" stroke-width="2"/>',
            text(370, 105, "strip"),
            text(370, 135, "Z_p,  N(s),  K,  m", size=16),
            line((150, 75), (250, 75)),
            line((150, 155), (250, 155)),
            terminal(146, 75),
            terminal(146, 155),
            arrow(170, 75, 206, 75, BLUE),
            text(188, 64, "i", color=BLUE),
            text(136, 121, "u", color=BLUE),
            line((490, 75), (590, 75)),
            line((490, 155), (590, 155)),
            terminal(594, 75),
            terminal(594, 155),
            arrow(570, 75, 534, 75, ORANGE),
            text(552, 64, "v", color=ORANGE),
            text(606, 121, "F", color=ORANGE),
            arrow(110, 208, 330, 208, BLUE),
            text(98, 200, "actuator", "start", 15, BLUE),
            arrow(630, 208, 410, 208, ORANGE),
            text(640, 200, "sensor", "end", 15, ORANGE),
        ],
    )


def svg(title: str, meaning: str, height: int, parts: list[str], name: str) -> str:
    """Return a drawing of width 740 as SVG, with its title and its meaning for those who do not see it."""
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" class="ilg-drawing" viewBox="0 0 740 {height}" role="img" '
            f'aria-labelledby="{name}-title {name}-meaning" font-family="sans-serif" color="#555">',
            f'<title id="{name}-title">{title}</title>',
            f'<desc id="{name}-meaning">{meaning}</desc>',
            f'<defs><marker id="{name}-head" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="7" markerHeight="7" '
            'orient="auto-start-reverse"><path d="M0,0 L10,5 L0,10 z" fill="currentColor"/></marker></defs>',
            *(part.replace("url(#head)", f"url(#{name}-head)") for part in parts),
            "</svg>\n",
        )
    )


def drawings() -> dict[str, str]:
    """Return file -> SVG."""
    return {f"{make.__name__}.svg": svg(*make(), make.__name__) for make in (strip, circuit, transformer, two_port)}


if __name__ == "__main__":
    for file, drawn in drawings().items():
        Path(__file__).with_name(file).write_text(drawn, encoding="utf-8")
