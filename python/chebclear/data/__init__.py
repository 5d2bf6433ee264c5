"""Results as data for other programs.

In: a `Dataset`, named arrays with dimensions, units and facts, which every result gives of itself; out: CSV
and MATLAB files, pandas data frames, xarray datasets. Uses `base`; no result class is known here.
"""
