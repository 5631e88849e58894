"""Least-squares fits and their statistics, on numbers only.

In: observations (numbers, and a function that predicts them) and starting values. Out: values, covariance, intervals,
criteria, identifiability. May import: the top level only (errors, units, files, arrays, findings).
"""
