"""Requirements on outputs and features, and the share of mechanisms that meet them.

In: limits, distributions and the runs of a study; out: shares with exact intervals. Uses `band`, `features`,
`sources`.
"""
