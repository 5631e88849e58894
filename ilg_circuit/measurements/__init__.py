"""Files of instruments -> records over time, impedance spectra and load tests, in SI units and ready for a fit.

In: paths. Out: `Record`, `Spectrum`, `LoadTest`. May import: the ground floor and `fit`.
"""
