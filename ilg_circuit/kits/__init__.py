"""A strip as a folder for who builds its driver: a SPICE library, symbols, decks that run as they are, and a page.

In: an `Actuator` and a drive. Out: a folder. May import: `control` and what is below it.

    subcircuit.py     the library: pins plus, minus, tip, position; a switch for the beam; the fit's tolerances
    tolerances.py     the fit's covariance as factors on the library's parameters
    loop.py           a PI controller for the strip, and its margins
    decks.py          .op, .ac, transient;              driver_decks.py  H-bridge, amplifier, position loop
    spread_decks.py   corners and Monte Carlo
    symbols.py        KiCad and LTspice
    page.py           how to use each;                  folder.py        all of it, written whole or not at all
"""
