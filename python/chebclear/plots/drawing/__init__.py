"""Pictures of a mechanism.

In: a `Scene`; out: matplotlib Axes. Uses `scene` and `base`.
"""
