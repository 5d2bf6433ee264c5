"""Decisions of a designer: which of two designs is better, and at which speeds a mechanism vibrates.

In: two studies and requirements, or a scene; out: paired differences with exact intervals, natural
frequencies and modes. Uses `study`, `execution`, `run`, `scene`, `report`, `plots` and `base`.
"""
