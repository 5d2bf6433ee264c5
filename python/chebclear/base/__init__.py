"""Small tools that every room shares: checks of arguments, quantities with intervals, files, progress.

In: plain values; out: plain values. Uses `errors` only.
"""
