"""Runs that are not simulated here.

In: a callable that returns named time series and numbers, or a table of finished runs; out: `RunTable`, all
runs of a study in one table. Uses the chapter `features` and the rooms `run`, `scene` and `base`.
"""
