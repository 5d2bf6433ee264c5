"""Accuracy against cost: methods and tolerances of the runs of a scene, bounds of a study, and which to take.

In: a `Scene` or a `Study`; out: tables with recommendations. Uses `study`, `run`, `plots`,
`scene`, `report`, `data` and `base`.
"""
