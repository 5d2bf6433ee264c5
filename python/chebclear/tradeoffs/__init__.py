"""Accuracy against cost of the runs of one scene: methods and tolerances, and which to take.

In: a `Scene`; out: a `Tradeoff` with tables and recommendations. Uses `run`, `plots`,
`scene`, `report`, `data` and `base`.
"""
