"""Features: the range of a scalar result over the box, and the effects of the parameters on it.

In: the table of all runs; out: intervals, effects of the parameters and rankings of tolerances.
Uses `study.band`, `run`, `report`, `scene` and `base`.
"""
