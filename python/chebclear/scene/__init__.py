"""The user's description of a mechanism: bodies, joints, laws, forces, drives, starts; and its summary in
words.

In: numbers and names; out: a `Scene`, which the core compiles. Uses `report` and
`base`.
"""
