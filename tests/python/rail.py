"""A scene file of a block on a rail, for tests of what files say beside their scenes."""

BLOCK = """
[[bodies]]
name = "block"
mass = {mass}
inertia = 1

[[joints]]
type = "prismatic"
name = "rail"
a = "ground"
b = "block"
axis = [1, 0]

[[start]]
type = "joint"
joint = "rail"
position = {position}
"""

PULL = """
[[forces]]
type = "force"
name = "pull"
point = "block"
x = "-stiffness*block.x"
y = 0
"""


def block(position, mass="1", pulled=False):
    """Its tables; the spring has a parameter `stiffness`."""
    return BLOCK.format(position=position, mass=mass) + (PULL if pulled else "")
