"""The search for tolerances of least cost: what they cost, models of what exceeds limits, and fresh runs.

In: a study, requirements and costs; out: the cheapest design with the runs that verify it. Uses `templates`,
`study`, `execution`, `run`, `scene`, `data` and `base`.
"""
