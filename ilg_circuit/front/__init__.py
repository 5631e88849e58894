"""The front door: one function for each task, which takes what users have.

In: a strip as an object, a path or a preset's name; quantities as SI numbers or texts with units; data as paths,
arrays or data frames. Out: results, strips and netlists. `ilg_circuit` shows these names; commands make one such call.
May import: all rooms but `reproduce` and `commands`.
"""
