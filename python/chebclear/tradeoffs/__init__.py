"""Accuracy against cost: of the runs of one scene, and of the bounds of one study.

In: a `Scene` or a `Study`; out: tables, recommendations. Uses `study`, `run`, `scene` and `base`.
"""
