"""Mechanisms of other programs: pylinkage and PMKS+.

In: an object, a file or a link of another program; out: a `Template`. Uses `templates`, `scene` and `base`.
"""
