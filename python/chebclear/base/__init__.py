"""Small helpers that every room shares: checks of arguments, quantities with intervals, files, progress.

In and out: plain values. Uses `errors` only.
"""
