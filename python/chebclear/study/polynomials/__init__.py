"""Polynomials in the uncertain parameters.

In: the box of the parameters and values at points of it; out: polynomials with their certified ranges, slopes
and shares of the variance. Uses `scene` and `base`.
"""
