"""Execution of the runs of a study: in pieces, on threads or by an executor, with a store.

In: numbered scenes and settings; out: a table of the runs with those that failed, in their order whatever the
order in which they were made. Uses `run`, `scene` and `base`.
"""
