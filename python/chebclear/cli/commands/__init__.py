"""The commands: each adds itself to the parser and runs.

In: parsed words; out: what is printed and written, and an exit code. Uses every room.
"""
