"""
A prediction with its uncertainty
=================================

A fitted strip keeps the covariance of its parameters. ``band`` carries it through the circuit: the prediction of a
run that was never measured has standard errors.
"""

import numpy as np

import ilg_circuit as ilg

time = np.arange(-5.0, 60.0, 0.25)
run = ilg.simulate("paper", "step:2V", times=time[time >= 0], beam="static", engine="exact")
rest = np.zeros(time.size - run.time.size)
random = np.random.default_rng(11)
fit = ilg.identify(
    time=time,
    voltage=np.append(rest, run.voltage),
    current=np.append(rest, run.current) + 2e-3 * random.normal(size=time.size),
    displacement=np.append(rest, run.displacement) + 5e-5 * random.normal(size=time.size),
    strip="paper",
    model="rc",
    onset="0 s",
)

# %%
predicted = ilg.simulate(fit.actuator, "square:-2V..2V,40s", "120 s", band=True, samples=241)

# sphinx_gallery_alt = "The predicted run under a square wave, with a band of two standard errors about each curve."
axes = predicted.plot()
