"""What the user writes: bodies, joints, laws, forces, drives, starts, and a description of it in words.

In: numbers and names; out: a `Scene`, which the core compiles. Uses `report` and
`base`.
"""
