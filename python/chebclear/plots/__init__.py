"""Figures of one thing each; every function takes `ax=None` and returns the Axes.

In: results; out: matplotlib Axes. Uses all rooms that make results.
"""
