"""Figures of one thing each; every function takes `ax=None` and returns the Axes.

In: results; out: matplotlib Axes. Uses `scene`, `report` and `base`; `subjects.py` declares
what it needs of results.
"""
