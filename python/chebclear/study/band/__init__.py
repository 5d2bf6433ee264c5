"""Bands: the range of an output over the box of the parameters, and its reliability.

In: the table of all runs; out: a `Band` with its verdict, quantiles and restraint zones.
Uses `study.polynomials`, `plots`, `scene` and `base`.
"""
