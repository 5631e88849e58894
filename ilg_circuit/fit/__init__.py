"""Least squares and its statistics, numbers only.

In: observations (numbers, and a function that predicts them) and starting values. Out: values, covariance, intervals,
criteria, identifiability. May import: the ground floor alone (errors, units, files, arrays, findings).
"""
