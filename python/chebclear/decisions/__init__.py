"""Decisions of a designer: is a design better, which tolerances cost least, does a model fit, and more.

In: studies with requirements and costs, a scene, or bands and a measured trace; out: paired differences with
exact intervals, rare shares, tolerances of least cost, better nominal values, natural frequencies and modes,
positions, transmission angles, lost motion, wear, shares of a trace inside bands, regions of parameters.
Uses `templates`, `study`, `execution`, `run`, `scene`, `report`, `plots`, `data` and `base`.
"""
