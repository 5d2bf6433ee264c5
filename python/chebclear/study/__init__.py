"""Many runs: a scene whose parameters are known as intervals.

In: a callable that builds scenes, and intervals; out: a `StudyResult` with a `Band` for every output.
Uses `plots`, `run`, `scene` and `base`.
"""
