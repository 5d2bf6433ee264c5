"""Features: how far a number of a run reaches over the box, and which parameter it depends on.

In: one number of every run; out: intervals, effects of the parameters and rankings of tolerances.
Uses `study.band`, `run`, `report`, `scene` and `base`.
"""
