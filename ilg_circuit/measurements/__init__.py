"""Files of instruments -> records over time, impedance spectra and load tests, in SI units and ready for a fit.

`read.read` takes a file of any kind and format; `formats` holds one module a format.

In: paths. Out: `Record`, `Spectrum`, `LoadTest`. May import: the ground floor and `fit`.
"""
