"""Where the runs of a study come from: scenes, a model of the user's own, or a table of finished runs.

In: points of the box; out: `RunTable`, all
runs of a study in one table. Uses `study.polynomials`, `execution`, `run`, `scene` and `base`.
"""
