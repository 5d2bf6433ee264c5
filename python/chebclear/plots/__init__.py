"""Figures of one thing each; every function takes `ax=None` and returns the Axes.

In: results; out: matplotlib Axes. Uses `scene` and `base`; what it asks of results is said in `subjects.py`.
"""
