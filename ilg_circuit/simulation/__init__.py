"""Simulates a strip under a drive: waveforms, impedance, sensed voltages, energy, and checks against closed forms.

In: an `Actuator` and a drive. Out: `Response`, `Impedance`, `Sensed`. May import: the top level, `fit`, `strip`,
`circuit`, `solve` and `measurements`.
"""
