"""Decisions between designs: the same mechanisms with two sets of lengths, tolerances or laws.

In: two studies and requirements; out: paired differences with exact intervals. Uses `study`, `run`, `scene`,
`report`, `plots` and `base`.
"""
