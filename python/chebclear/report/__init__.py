"""Tables that a person reads.

In: results; out: text and Markdown.
"""
