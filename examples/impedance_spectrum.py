"""
The impedance at the terminals
==============================

ngspice's small-signal analysis of the strip, between any two frequencies; ``bias`` sets the voltage about which it
is taken.
"""

import ilg_circuit as ilg

spectrum = ilg.impedance("paper", "1 mHz", "10 kHz")
print(spectrum.summary())

# %%

# sphinx_gallery_alt = "Bode and Nyquist plot of the strip: 660 ohm at rest, 19 ohm at high frequency, one semicircle."
axes = spectrum.plot()
