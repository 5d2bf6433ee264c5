"""Moving pictures of runs.

In: a run with the positions of its bodies; out: GIF, HTML and MP4 files. Uses `drawing`, `scene` and `base`.
"""
