"""Bands: how far an output reaches over the box of the parameters, and how sure that is.

In: the values of an output in all runs; out: a `Band` with its verdict, quantiles and restraint zones.
Uses `study.polynomials`, `plots`, `scene` and `base`.
"""
