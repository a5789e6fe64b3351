"""Highways as files of Nav2's route server: round trips, layout, refusals."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_mobarm.exceptions import MapError, OutputError
from drake_mobarm.navigation.geojson import read_highway, write_highway
from drake_mobarm.navigation.highway import (
    Highway,
    HighwayParameters,
    build_highway,
)
from helpers.plans import plan_of


def point(number, x, y, **properties):
    return {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [x, y]},
        "properties": {"id": number, **properties},
    }


def edge(number, start, end, **properties):
    """As Nav2's own files have it, without coordinates."""
    return {
        "type": "Feature",
        "geometry": {"type": "MultiLineString"},
        "properties": {
            "id": number,
            "startid": start,
            "endid": end,
            **properties,
        },
    }


def graph(*features):
    return {"type": "FeatureCollection", "features": list(features)}


def small_graph():
    """Two points 5 m apart, ids not from 0, plugins' data on both."""
    return graph(
        edge(40, 30, 7, cost=10.0, overridable=False),
        point(30, 1.0, 2.0, frame="map", metadata={"class": "hall"}),
        point(7, 4.0, 6.0, frame="map", operations={"stop": {"type": "x"}}),
        edge(41, 7, 30, metadata={"speed_limit": 0.5}),
    )


def assert_refused(folder, file, message):
    """A file is refused in one line that names it and says what is wrong."""
    path = folder / "graph.geojson"
    path.write_text(file if isinstance(file, str) else json.dumps(file))
    with pytest.raises(MapError) as caught:
        read_highway(path)
    text = str(caught.value)
    assert text.startswith(f"highway {path}: ")
    assert message in text
    assert "\n" not in text


# Writing


def test_file_has_the_layout_that_nav2_reads(tmp_path):
    path = tmp_path / "highway.geojson"
    highway = Highway.from_links([(0, 0), (3, 4), (3, 0)], [(0, 1), (1, 2)])
    write_highway(highway, path, frame="floor")
    file = json.loads(path.read_text())
    assert file["type"] == "FeatureCollection"
    nodes, edges = file["features"][:3], file["features"][3:]
    assert nodes[1] == {
        "type": "Feature",
        "properties": {"id": 1, "frame": "floor"},
        "geometry": {"type": "Point", "coordinates": [3.0, 4.0]},
    }
    # Each link is an edge there and an edge back.
    assert {
        (e["properties"]["startid"], e["properties"]["endid"]) for e in edges
    } == {(0, 1), (1, 0), (1, 2), (2, 1)}
    assert len(edges) == 4
    assert edges[0]["properties"] == {
        "id": 3,
        "startid": 0,
        "endid": 1,
        "cost": 5.0,
        "overridable": True,
    }
    assert edges[0]["geometry"] == {
        "type": "MultiLineString",
        "coordinates": [[[0.0, 0.0], [3.0, 4.0]]],
    }
    # No node or edge has another's id.
    ids = [feature["properties"]["id"] for feature in file["features"]]
    assert len(set(ids)) == len(ids)


@given(st.integers(0, 2**32))
def test_what_is_written_is_read_to_the_bit(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 10))
    links = np.argwhere(np.triu(rng.random((n, n)) < 0.4, 1))
    highway = Highway.from_links(rng.normal(0, 100, (n, 2)), links)
    path = tmp_path_factory.mktemp("highway") / "highway.geojson"
    write_highway(highway, path)
    read = read_highway(path)
    np.testing.assert_array_equal(read.points, highway.points)
    np.testing.assert_array_equal(read.links, highway.links)
    np.testing.assert_array_equal(read.length, highway.length)


def test_built_highway_comes_back_whole(tmp_path):
    rng = np.random.default_rng(0)
    grid = plan_of(rng.random((20, 20)) < 0.2, cell=0.2)
    highway = build_highway(grid, HighwayParameters(), rng)
    write_highway(highway, tmp_path / "highway.geojson")
    read = read_highway(tmp_path / "highway.geojson")
    assert read.describe() == highway.describe()
    np.testing.assert_array_equal(read.before, highway.before)


def test_file_that_cannot_be_written_is_told(tmp_path):
    highway = Highway.from_links([(0, 0)], [])
    with pytest.raises(OutputError, match="No such file"):
        write_highway(highway, tmp_path / "missing" / "highway.geojson")


# Reading


def test_graph_of_nav2_is_read_whatever_its_ids_and_order(tmp_path):
    path = tmp_path / "graph.geojson"
    path.write_text(json.dumps(small_graph()))
    highway = read_highway(path)
    np.testing.assert_array_equal(highway.points, [(1, 2), (4, 6)])
    assert highway.links.tolist() == [[0, 1]]
    # The straight line, not the cost of 10.
    assert highway.length[0, 1] == pytest.approx(5.0)


def test_points_without_a_frame_are_in_that_of_the_map(tmp_path):
    path = tmp_path / "graph.geojson"
    path.write_text(
        json.dumps(graph(point(1, 0, 0), point(2, 1, 0, frame="map")))
    )
    assert len(read_highway(path).points) == 2


def test_file_that_is_not_there_is_told(tmp_path):
    path = tmp_path / "none.geojson"
    with pytest.raises(MapError, match="No such file") as caught:
        read_highway(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1, 2", "[" * 10**5])
def test_file_that_is_no_json_is_refused(text, tmp_path):
    assert_refused(tmp_path, text, "no JSON")


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ([], "its type is None: valid is FeatureCollection"),
        ({"type": "Feature"}, "its type is 'Feature'"),
        ({"type": "FeatureCollection"}, "features is None: valid is a list"),
        (graph(), "no Point features"),
        (graph(edge(1, 2, 3)), "no Point features"),
        (graph(3), "feature 0 has geometry None"),
        (graph(point(1, 0, 0), {"geometry": {}}), "feature 1 has properties"),
        (
            graph({"geometry": {"type": "Polygon"}, "properties": {"id": 1}}),
            "feature 0 is a 'Polygon': valid are Point, MultiLineString",
        ),
        (graph(point(True, 0, 0)), "feature 0 has id True"),
        (graph(point(1.5, 0, 0)), "feature 0 has id 1.5"),
        (graph(point(-1, 0, 0)), "feature 0 has id -1"),
        (graph(point(2**32, 0, 0)), "valid is a whole number, 0 to 4294967295"),
        (graph(point(1, 0, 0), point(1, 1, 0)), "id 1 is there twice"),
        (graph(point(1, 0, math.nan)), "point 1 has coordinates [0, nan]"),
        (graph(point(1, 0, math.inf)), "point 1 has coordinates [0, inf]"),
        (graph(point(1, 0, 10**400)), "point 1 has coordinates"),
        (graph(point(1, 0, "far")), "point 1 has coordinates [0, 'far']"),
        (
            graph(point(1, 0, 0, frame="map"), point(2, 1, 0, frame="odom")),
            "its points are in the frames ['map', 'odom']",
        ),
        (
            graph(point(1, 0, 0), edge(2, 1, 9)),
            "edge 2 has endid 9: valid are ids of points",
        ),
        (graph(point(1, 0, 0), edge(2, 2, 1)), "edge 2 has startid 2"),
        (graph(point(1, 0, 0), edge(2, None, 1)), "edge 2 has startid None"),
        (graph(point(1, 0, 0), edge(2, 1, 1)), "from point 1 to itself"),
        (
            graph(point(5, 0, 0), point(6, 1, 0), edge(7, 5, 6)),
            "edge 7 leads from point 5 to 6 and none back",
        ),
    ],
)
def test_file_that_is_no_such_graph_is_refused(file, message, tmp_path):
    assert_refused(tmp_path, file, message)
