"""
How fast does a repeated path learn its voltage?
================================================

A strip is fitted to a short noisy record, and its tip shall follow a path again and again. The factor by which the
error falls each trial is known before the first one, for every strip that the fit leaves possible.
"""

import numpy as np

import ilg_circuit as ilg

times = np.linspace(0, 100, 101)
run = ilg.simulate("paper", "step:4V", times=times, engine="exact", beam="static")
noise = np.random.default_rng(1).normal(size=(2, len(times)))
record = {
    "time_s": times,
    "voltage_V": run.voltage,
    "current_A": run.current + 2e-3 * noise[0],
    "displacement_m": run.displacement + 4e-5 * noise[1],
}
fit = ilg.identify(record, "paper", model="rc", engine="exact")
learned = ilg.learn(fit.actuator, "sine:3mm,5mHz", "200 s", trials=5, draws=50)
print(learned.summary())

# %%

# sphinx_gallery_alt = "Errors of the trials, all below what is promised; error and voltage of two trials."
axes = learned.plot()

# %%
# Trials on the true strip, each measured, each giving the voltage of the next. The promise holds.

drive, errors = learned.drive, []
for _ in range(4):
    done = ilg.simulate("paper", drive, "200 s", samples=401, engine="exact", beam="static")
    trial = (done.time, done.voltage, done.displacement)
    step = ilg.learn(fit.actuator, "sine:3mm,5mHz", "200 s", trial=trial, draws=0)
    drive = step.drive
    errors.append(step.trial_error)
print("errors:", ", ".join(f"{1e6 * error:.2f} um" for error in errors))
print("promised:", ", ".join(f"{1e6 * bound:.2f} um" for bound in learned.bounds[:4]))
