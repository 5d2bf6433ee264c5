"""The case study of the paper: its set-up and printed values, its tables.

In: nothing but the paper's numbers; out: tables and arrays. Uses every room.
"""
