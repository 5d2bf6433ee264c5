"""The search for nominal values with which most mechanisms keep to requirements, by models and fresh runs.

In: a study, requirements and what may move; out: nominal values with the runs that verify them.
Uses `study`, `execution`, `run`, `scene` and `base`.
"""
