"""The report of a study.

In: bands, features and runs of a study; out: a `Document`, a summary, a `Dataset`.
Uses `study.features`, `study.band`, `run`, `plots`, `report`, `data`, `scene` and `base`.
"""
