"""The case study of the paper: its set-up and printed values, its tables and figures.

In: nothing but the paper's numbers; out: tables and figures. Uses every room.
"""
