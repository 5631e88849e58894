"""
What does a controller do with a camera in the loop?
====================================================

A controller written in Python, called every 0.5 s within ngspice's transient. It is given what a camera sees: 40 ms
late, with noise, in steps of a pixel.
"""

import ilg_circuit as ilg


class ProportionalIntegral:
    """A PI controller that stops integrating while its voltage is at the limit."""

    def __init__(self, gain, reset_time, period, limit):
        self.gain, self.rate, self.limit = gain, gain * period / reset_time, limit
        self.integral = 0.0

    def step(self, reference, measured):
        error = reference - measured
        voltage = self.gain * error + self.integral
        if abs(voltage) < self.limit or voltage * error < 0:
            self.integral += self.rate * error
        return voltage


controller = ProportionalIntegral(gain=5e3, reset_time=15.0, period=0.5, limit=4.0)
camera = {"delay": "40 ms", "noise": "5 um", "quantum": "20 um"}
closed = ilg.close_loop("paper", controller, "step:3mm", "120 s", period="0.5 s", voltage="4 V", **camera)
print(closed.summary())

# %%

# sphinx_gallery_alt = "Displacement with what the camera measured, the error, and the voltage, which is held in steps."
axes = closed.plot()

# %%
# A tuned PI can also be built: of operational amplifiers, with resistors of E24 and capacitors of E12. The deck of the
# loop is ``built.netlist``, with the designators of this parts list.

tuned = ilg.tune("paper", "3 mm", gains="gain=20V/mm,reset_time=10s", beam="static")
built = ilg.close_loop("paper", tuned, "step:3mm", "120 s", form="op-amps", beam="static")
print(built.summary())
for part in built.circuit.parts:
    print(f"{part.designator:<4} {part.text:<30} {part.purpose}")
