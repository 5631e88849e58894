"""Central pattern generator: Matsuoka's neurons, their rhythms, and the same network as an ngspice netlist.

In: a network and its start. Out: its rhythm, as data. May import: the ground floor, `solve`, `circuit`.

Nothing is imported here, so that the command line starts fast:

- `network`: `Network`, wirings (`unit`, `ring`, `chain`), starts, weights from a file
- `rhythm`: what a network does in the end: cycle or rest, period, amplitude, phase lags
- `report`: a run at given times, as CSV, JSON and text; `plots`: as pictures
- `sweep`: rhythms over a parameter; `rest`: states of rest; `flow`: the exact flow; `netlist`: ngspice
"""
