"""Reports that a person reads.

In: a `Document`, headings, sentences, tables and pictures, which a result says of itself; out: one HTML file
that needs no network. Uses `base`; no result class is known here.
"""
