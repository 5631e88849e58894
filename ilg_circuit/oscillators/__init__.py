"""Central pattern generator: Matsuoka's neurons, their rhythms, and the same network as an ngspice netlist.

In: a network and its start. Out: its rhythm, as data. May import: the ground floor, `control` and below.

Nothing is imported here, so that the command line starts fast:

- `network`: `Network`, wirings (`unit`, `ring`, `chain`), starts, weights from a file
- `rhythm`: long-term behaviour of a network: cycle or rest, period, amplitude, phase lags
- `run`: a run at given times; `cpg` in one call
- `sweep`: rhythms over a parameter, `cpg_sweep` in one call
- `reflex`: neurons and the strips that they drive and feel; `loop_rhythm`, `loop_run`, `loop_netlist`: the same as
  above for these; `entrainment`: the range of frequencies to which their rhythm locks
- `orbits`: closed orbits by Newton's method
- `rest`: states of rest; `flow`: the exact flow; `netlist`: ngspice
"""
