"""Many runs: a scene whose parameters are known as intervals.

In: a callable that builds scenes or is a model itself, or a table of finished runs, and intervals; out: a
`StudyResult` with a `Band` for every output.
Uses its chapters `polynomials`, `band`, `features`, `sources` and `report`, which build on each other in this
order, and the rooms `mechanisms`, `plots`, `execution`, `run`, `scene`, `report`, `data` and `base`.
"""
