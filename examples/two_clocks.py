"""
A camera on a clock of its own
==============================

The current comes from the potentiostat, the displacement from a camera that was started by hand. Edges of the drive
tell how much later the camera's clock reads, and how fast it goes.
"""

import numpy as np

import ilg_circuit as ilg

random = np.random.default_rng(4)
square = ilg.simulate("paper", "square:4V,16s", times=np.arange(0.0, 40.0, 0.16), engine="exact", beam="static")
time = np.arange(0.0, 45.0, 0.2)
on = time > 5.05
seen = ilg.simulate("paper", "square:4V,16s", times=time[on] - 5.05, engine="exact", beam="static")
voltage, current = np.zeros(time.size), np.zeros(time.size)
voltage[on], current[on] = seen.voltage, seen.current
current += 4e-4 * random.normal(size=time.size)

# %%
# The camera reads 812.4 s earlier and 1 % fast. It measures pixels of 42 micrometres.
frames = np.arange(-3.2, 40.0, 0.16)
moved = np.append(np.zeros(frames.size - square.time.size), square.displacement)
moved = moved[: frames.size] + 8e-6 * random.normal(size=frames.size)
camera = {"time_s": 5.05 - 812.4 + 1.01 * frames, "x_px": moved / 42e-6}

record = {"time_s": time, "voltage_V": voltage, "current_A": current}
fit = ilg.identify(record, "paper", displacement=camera, scale="42 um/px", model="rc", engine="exact")
for name in ("displacement_delay", "displacement_clock_rate"):
    low, high = fit[name].interval
    print(f"{name:24} {fit[name].value:10.4f}, 95 %: {low:.4f} to {high:.4f} {fit[name].unit}")

# %%

# sphinx_gallery_alt = "Current and displacement under a square wave, measured and fitted, on the voltage's clock."
axes = fit.plot()
