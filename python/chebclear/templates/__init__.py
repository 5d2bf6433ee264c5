"""Scene files: mechanisms whose numbers are quantities with units and expressions of named parameters.

In: TOML or JSON text; out: a `Template`, which gives scenes and studies. Uses `study`, `run`,
`plots`, `scene`, `report`, `data` and `base`.
"""
