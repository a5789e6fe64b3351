"""Small worlds in SDF, and where they go wrong."""

import pytest

from drake_mobarm.exceptions import WorldError
from drake_mobarm.world.sdf import load_world

BOX = "<box><size>2 4 6</size></box>"
PLANE = "<plane><normal>0 0 1</normal><size>9 9</size></plane>"


def collision(shape=BOX, name="wall", pose="0 0 0 0 0 0"):
    """A collision in four lines."""
    return (
        f'<collision name="{name}">\n<pose>{pose}</pose>\n'
        f"<geometry>{shape}</geometry>\n</collision>\n"
    )


def visual(shape=BOX, name="look"):
    return collision(shape, name).replace("collision", "visual")


def model(inside="", name="house", pose="0 0 0 0 0 0", static="true"):
    """A model of one link."""
    return (
        f'<model name="{name}">\n<static>{static}</static>\n'
        f'<pose>{pose}</pose>\n<link name="building">\n{inside}</link>\n'
        "</model>\n"
    )


def world(*inside, version="1.9"):
    """A file that holds a world."""
    return (
        f'<?xml version="1.0"?>\n<sdf version="{version}">\n'
        f'<world name="w">\n{"".join(inside)}</world>\n</sdf>\n'
    )


def line_of(text, part, number=0):
    """The line in which a part of a text begins, of several the number-th."""
    start = -1
    for _ in range(number + 1):
        start = text.index(part, start + 1)
    return text[:start].count("\n") + 1


def saved(folder, text, name="mine.sdf"):
    """The path of a new file with a text."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return str(path)


def faults(path, meshes="refuse"):
    """What is wrong with a world: its message, without the file's name."""
    with pytest.raises(WorldError) as caught:
        load_world(path, meshes)
    message, start = str(caught.value), f"world {path}: "
    assert message.startswith(start)
    rest = message.removeprefix(start)
    # The file is named once, and it is one line.
    assert path not in rest
    assert "\n" not in rest
    return rest.split("; ")
