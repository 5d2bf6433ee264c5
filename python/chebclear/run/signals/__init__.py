"""What is found in the samples of an output: its averaged spectrum, and its load cycles.

In: the instants and columns of a run; out: `Spectrum`, `Cycles`. Uses `plots`, `report`, `data`,
`scene` and `base`.
"""
