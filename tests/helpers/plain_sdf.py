"""A reader of simple SDF files without Drake, to compare worlds with.

It knows poses, frames, nested and included models and states, and takes all
else for granted.
"""

import re
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation


class Solid(NamedTuple):
    """A shape, its numbers, and where it is."""

    name: str
    tag: str
    numbers: list[float]
    X_WG: np.ndarray

    def holds(self, points, grown=0.0):
        """Whether it holds points (n, 3), if grown by so much on all sides."""
        p = (points - self.X_WG[:3, 3]) @ self.X_WG[:3, :3]
        x, y, z = p.T
        if self.tag == "box":
            half = np.array(self.numbers) / 2 + grown
            return np.all(np.abs(p) <= half, axis=1)
        radius, length = [*self.numbers, 0.0][:2]
        if self.tag == "cylinder":
            aside = np.hypot(x, y) <= radius + grown
            return aside & (np.abs(z) <= length / 2 + grown)
        beyond = np.maximum(np.abs(z) - length / 2, 0)
        return np.hypot(np.hypot(x, y), beyond) <= radius + grown


def read_solids(path):
    """All collisions of a world, planes too."""
    root = _root(Path(path))
    world = root if root.find("world") is None else root.find("world")
    states = {
        model.get("name"): _matrix(model.find("pose"))
        for model in world.iterfind("state/model")
    }
    solids = []
    scope = _Scope("world", world, Path(path).parent)
    for name in scope.models:
        X = states.get(name)
        X_WM = scope.pose(name) if X is None else X
        _read_model(scope.models[name], X_WM, Path(path).parent, solids)
    return solids


def _root(path):
    data = path.read_bytes()
    try:
        text = data.decode()
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    text = re.sub("<!--.*?-->", "", text, flags=re.S).strip()
    text = re.sub("<(/?)gz:", r"<\1", text).replace(" & ", " and ")
    return ElementTree.fromstring(text)


class _Scope:
    """What poses may refer to in a model or a world."""

    def __init__(self, default, node, folder):
        self.default = default
        self.nodes = {}
        self.models = {}
        for child in node:
            if child.tag in ("link", "frame", "model"):
                self.nodes[child.get("name")] = child
            if child.tag == "model":
                self.models[child.get("name")] = child
            uri = child.findtext("uri", "").removeprefix("model://")
            if child.tag == "include" and uri != "sun":
                model = _included(uri, folder)
                name = child.findtext("name", model.get("name"))
                pose = child.find("pose")
                self.nodes[name] = child if pose is not None else model
                self.models[name] = model

    def pose(self, name):
        if name in (None, "", self.default):
            return np.eye(4)
        node = self.nodes[name]
        pose = node.find("pose")
        base = node.get("attached_to")
        if pose is not None:
            base = pose.get("relative_to", base)
        return self.pose(base) @ _matrix(pose)


def _included(uri, folder):
    if uri == "ground_plane":
        return ElementTree.fromstring(
            '<model name="ground_plane"><link name="link"><collision name="c">'
            "<geometry><plane/></geometry></collision></link></model>"
        )
    return _root(folder / "models" / uri / "model.sdf").find("model")


def _read_model(node, X_WM, folder, solids):
    scope = _Scope("__model__", node, folder)
    for link in node.iterfind("link"):
        X_WL = X_WM @ scope.pose(link.get("name"))
        for collision in link.iterfind("collision"):
            shape = collision.find("geometry")[0]
            numbers = " ".join(
                extent.text for extent in shape if shape.tag != "plane"
            )
            solids.append(
                Solid(
                    collision.get("name"),
                    shape.tag,
                    [float(word) for word in numbers.split()],
                    X_WL @ _matrix(collision.find("pose")),
                )
            )
    for name, model in scope.models.items():
        _read_model(model, X_WM @ scope.pose(name), folder, solids)


def _matrix(pose):
    X = np.eye(4)
    if pose is not None and (pose.text or "").strip():
        x, y, z, *angles = map(float, pose.text.split())
        degrees = pose.get("degrees") == "true"
        turn = Rotation.from_euler("xyz", angles, degrees=degrees)
        X[:3, :3], X[:3, 3] = turn.as_matrix(), (x, y, z)
    return X
