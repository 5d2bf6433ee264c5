"""Decisions of a designer: is a design better, does a model fit a trace, how does it vibrate, how far play.

In: two studies and requirements, a scene, or bands and a measured trace; out: paired differences with exact
intervals, natural frequencies and modes, positions and transmission angles, lost motion, shares of a trace
inside bands, regions of parameters. Uses `study`, `execution`, `run`, `scene`, `report`, `plots` and `base`.
"""
