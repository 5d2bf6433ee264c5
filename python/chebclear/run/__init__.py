"""One run: a scene through time.

In: a `Scene` and `Settings`; out: a `Trajectory` with its samples, events, contacts and estimate of error,
and an end from which another run continues. Uses `plots`, `scene`, `report`, `data` and `base`.
"""
