"""Highways as GeoJSON files, in the layout of Nav2's route server.

A file is a FeatureCollection: a Point for each node, with its `id` and `frame`,
and a MultiLineString for each edge, with its `id`, `startid`, `endid` and
`cost`. Edges lead one way only, so that a link is two of them; the ids of
nodes and edges together are unique.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from drake_mobarm.checks import shown
from drake_mobarm.exceptions import MapError, OutputError
from drake_mobarm.geometry import FARTHEST
from drake_mobarm.navigation.highway import Highway

_EDGES = ("MultiLineString", "LineString")
_MOST_ID = 2**32 - 1  # Nav2 reads them as unsigned numbers of 32 bits.


def write_highway(
    highway: Highway, path: str | Path, frame: str = "map"
) -> None:
    """Writes a highway for Nav2's route server; costs are lengths [m].

    Nav2 takes no graph without edges.

    Args:
        highway: what to write.
        path: of the file, of which an earlier one is replaced.
        frame: name of the frame W in ROS.

    Raises:
        OutputError: the file cannot be written.
    """
    nodes = [
        _feature("Point", xy, {"id": number, "frame": frame})
        for number, xy in enumerate(highway.points.tolist())
    ]
    one_way = np.vstack([highway.links, highway.links[:, ::-1]])
    ends = highway.points[one_way]
    cost = np.hypot(*(ends[:, 0] - ends[:, 1]).T)
    edges = [
        _feature(
            "MultiLineString",
            [line],
            {
                "id": len(nodes) + number,
                "startid": start,
                "endid": end,
                "cost": length,
                "overridable": True,
            },
        )
        for number, ((start, end), line, length) in enumerate(
            zip(one_way.tolist(), ends.tolist(), cost.tolist(), strict=True)
        )
    ]
    collection = {
        "type": "FeatureCollection",
        "name": "highway",
        # Nav2's own files name this projection, in whose units x and y are m.
        "crs": {
            "type": "name",
            "properties": {"name": "urn:ogc:def:crs:EPSG::3857"},
        },
        "features": nodes + edges,
    }
    try:
        Path(path).write_text(json.dumps(collection, indent=1) + "\n", "utf-8")
    except OSError as error:
        raise OutputError(
            f"highway {path} cannot be written: {error.strerror}"
        ) from error


def read_highway(path: str | Path) -> Highway:
    """Reads a highway from a route graph of Nav2.

    A link is as long as the straight line between its points: `cost` and the
    coordinates of edges are not read, nor is what Nav2 keeps for its plugins
    (`metadata`, `operations`).

    Returns:
        The highway; its points are in the order of the file, in the file's
        frame.

    Raises:
        MapError: the file cannot be read, is no such graph, or has an edge
            without one back; a highway's links lead both ways.
    """
    try:
        return _parse(_load(path))
    except MapError as error:
        raise MapError(f"highway {path}: {error}") from error


def _feature(
    kind: str, coordinates: Any, properties: dict[str, Any]
) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def _load(path: str | Path) -> Any:
    try:
        return json.loads(Path(path).read_bytes())
    except OSError as error:
        raise MapError(f"it cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise MapError(f"it is no JSON: {error}") from error


def _parse(file: Any) -> Highway:
    kind = file.get("type") if isinstance(file, dict) else None
    if kind != "FeatureCollection":
        raise MapError(f"its type is {shown(kind)}: valid is FeatureCollection")
    features = file.get("features")
    if not isinstance(features, list):
        raise MapError(f"features is {shown(features)}: valid is a list")
    known: set[int] = set()
    number_of: dict[int, int] = {}
    points: list[list[float]] = []
    frames, edges = set(), []
    for index, feature in enumerate(features):
        geometry = _member(feature, "geometry", index)
        properties = _member(feature, "properties", index)
        kind = geometry.get("type")
        if kind != "Point" and kind not in _EDGES:
            raise MapError(
                f"feature {index} is a {shown(kind)}: valid are Point, "
                + ", ".join(_EDGES)
            )
        number = _id(properties, "id", f"feature {index}")
        if number in known:
            raise MapError(f"id {number} is there twice: valid are unique ids")
        known.add(number)
        if kind == "Point":
            number_of[number] = len(points)
            points.append(_position(geometry, number))
            frames.add(str(properties.get("frame", "map")))
        else:
            edges.append((number, properties))
    if not points:
        raise MapError("it has no Point features: valid is one or more")
    if len(frames) > 1:
        raise MapError(
            f"its points are in the frames {shown(sorted(frames))}: "
            "valid is one frame"
        )
    return Highway.from_links(points, _links(edges, number_of))


def _links(
    edges: list[tuple[int, dict[str, Any]]], number_of: dict[int, int]
) -> list[tuple[int, int]]:
    """The pairs of points between which edges lead both ways."""
    pairs = {}
    for number, properties in edges:
        ends = [
            _id(properties, key, f"edge {number}")
            for key in ("startid", "endid")
        ]
        for key, end in zip(("startid", "endid"), ends, strict=True):
            if end not in number_of:
                raise MapError(
                    f"edge {number} has {key} {end}: valid are ids of points"
                )
        if ends[0] == ends[1]:
            raise MapError(
                f"edge {number} leads from point {ends[0]} to itself: valid "
                "are two points"
            )
        pairs[number_of[ends[0]], number_of[ends[1]]] = (number, *ends)
    for (i, j), (number, start, end) in pairs.items():
        if (j, i) not in pairs:
            raise MapError(
                f"edge {number} leads from point {start} to {end} and none "
                "back: valid are edges both ways"
            )
    return list(pairs)


def _member(feature: Any, key: str, index: int) -> dict[str, Any]:
    value = feature.get(key) if isinstance(feature, dict) else None
    if not isinstance(value, dict):
        raise MapError(
            f"feature {index} has {key} {shown(value)}: valid is an object"
        )
    return value


def _id(properties: dict[str, Any], key: str, owner: str) -> int:
    value: Any = properties.get(key)
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole or not 0 <= value <= _MOST_ID:
        raise MapError(
            f"{owner} has {key} {shown(value)}: valid is a whole number, 0 to "
            f"{_MOST_ID}"
        )
    return int(value)


def _position(geometry: dict[str, Any], number: int) -> list[float]:
    value: Any = geometry.get("coordinates")
    fits = (
        isinstance(value, list)
        and len(value) >= 2
        and all(
            type(x) in (int, float) and abs(x) <= FARTHEST for x in value[:2]
        )
    )
    if not fits:
        raise MapError(
            f"point {number} has coordinates {shown(value)}: valid is [x, y] "
            f"in m, each in [-{FARTHEST:g}, {FARTHEST:g}]"
        )
    return [float(x) for x in value[:2]]
