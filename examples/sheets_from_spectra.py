"""
Sheets' resistance from spectra
===============================

The resistance along the electrodes, from impedance spectra: one length often does not tell it from the strip's own
resistances, and says so; two lengths do.
"""

import numpy as np

import ilg_circuit as ilg

# %%
# Spectra as if measured, on pieces of 20 mm and 35 mm whose sheets have 0.5 ohm per square, both added: a line that is
# contacted at one end.

f = np.geomspace(1e-3, 100, 41)
admittance = (1 / 667 + 1 / (19.4 + 1 / (2j * np.pi * f * 0.35))) / 35e-3  # of a length [S/m]
along = 0.5 / 5e-3  # [ohm/m]
random = np.random.default_rng(1)
spectra = []
for length in (20e-3, 35e-3):
    z = np.sqrt(along / admittance) / np.tanh(np.sqrt(along * admittance) * length)
    z += 2e-3 * np.abs(z) * (random.normal(size=41) + 1j * random.normal(size=41))
    spectra.append({"frequency_Hz": f, "re_ohm": z.real, "im_ohm": z.imag})

# %%
# One spectrum gives an upper limit, and what would separate the two:

one = ilg.identify_sheets(spectra[1], "35 mm", width="5 mm", model="rc")
print(one["sheet_resistance"], one.separable)
print("\n".join(one.warnings))

# %%

# sphinx_gallery_alt = "Spectra of two pieces with the fit over them, over frequency and in the plane; the residuals."
both = ilg.identify_sheets(spectra, "20 mm, 35 mm", width="5 mm", model="rc")
print(both.summary())
figure = both.plot()
