"""``chebclear show``: a mechanism in the browser.

In: a scene file, read again when it is saved, and values of its parameters; out: a page for this computer
alone, and what it asks for while sliders are dragged. Uses every room, as the other commands.
"""
