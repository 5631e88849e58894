"""Write the netlists paper_* of this folder again; a test keeps them current. The others are written by hand.

Run: python netlists/generate.py
"""

from pathlib import Path

from ilg_circuit.circuit import strip_netlist
from ilg_circuit.circuit.deck import deck
from ilg_circuit.circuit.library import library
from ilg_circuit.drive import PiecewiseLinear, Sine
from ilg_circuit.files import write_text
from ilg_circuit.strip.actuator import PAPER


def texts() -> dict[str, str]:
    """File name -> text of every netlist that the package writes."""
    free = strip_netlist(PAPER)
    clamped = strip_netlist(PAPER, tip="clamped")
    return {
        "paper_strip.lib": library(PAPER),
        "paper_step.cir": deck(free, PiecewiseLinear.step(4.0), 300.0, PAPER),
        "paper_step_clamped.cir": deck(clamped, PiecewiseLinear.step(4.0), 300.0, PAPER),
        "paper_square.cir": deck(free, PiecewiseLinear.square(0.0, 4.0, 30.0, 300.0), 300.0, PAPER),
        "paper_sine.cir": deck(free, Sine(2.0, 0.1), 60.0, PAPER),
    }


if __name__ == "__main__":
    for name, text in texts().items():
        write_text(Path(__file__).parent / name, text)
