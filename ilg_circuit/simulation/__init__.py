"""A strip under a drive: waveforms, impedance, sensed voltages, energy, and the checks against closed forms.

In: an `Actuator` and a drive. Out: `Response`, `Impedance`, `Sensed`. May import: the ground floor, `fit`, `strip`,
`circuit`, `solve` and `measurements`.
"""
