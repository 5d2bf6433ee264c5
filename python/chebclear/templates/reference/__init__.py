"""What may stand in a scene file, for editors and for people: made from the records that `load` reads.

In: the dataclasses of scenes and settings; out: a JSON Schema, and tables of all fields. Uses `scene`, `run`
and `base`.
"""
