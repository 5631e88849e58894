"""
How soon can a controller settle, and how robust is it?
=======================================================

A controller tuned for a strip that was fitted. It settles a step of 3 mm almost as soon as any voltage within 4 V
could, and keeps its margins at every sample of the fit's covariance.
"""

import numpy as np

import ilg_circuit as ilg

# a step as it would be measured, with 1 % noise
run = ilg.simulate("paper", "step:4V", "300 s", samples=201, engine="exact", beam="static")
random = np.random.default_rng(1)
measured = {
    name: values + 0.01 * np.abs(values).max() * random.standard_normal(len(values))
    for name, values in (("current", run.current), ("displacement", run.displacement))
}
fit = ilg.identify(
    time=run.time, voltage=run.voltage, **measured, strip="paper", model="rc", onset="0 s", engine="exact"
)

# %%
tuned = ilg.tune(fit.actuator, "3 mm", "lqg", beam="dynamic", delay="40 ms", draws=50)
print(tuned.summary(), *tuned.warnings, sep="\n")

# %%

# sphinx_gallery_alt = "Displacement, voltage and error of the step; Nyquist and sizes, with 50 samples of the fit."
axes = tuned.plot()
