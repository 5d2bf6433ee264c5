"""What a report says of a study.

In: bands, features and runs of a study; out: a `Document`.
Uses `study.features`, `study.band`, `run`, `plots`, `report`, `scene` and `base`.
"""
