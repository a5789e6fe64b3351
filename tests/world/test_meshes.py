"""Meshes: refused, or boxes or hulls in the place of their parts."""

import sys

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import ParameterError, WorldError
from drake_mobarm.world.sdf import load_world
from helpers.sdf import (
    BOX,
    collision,
    faults,
    line_of,
    model,
    saved,
    visual,
    world,
)
from helpers.shapes import turned

# A box's corners by the signs of x, y and z, and its sides' triangles.
SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
SIDES = [
    (0, 1, 3, 2),
    (4, 6, 7, 5),
    (0, 4, 5, 1),
    (2, 3, 7, 6),
    (0, 2, 6, 4),
    (1, 5, 7, 3),
]
TRIANGLES = [(a, b, c) for a, b, c, _ in SIDES] + [
    (a, c, d) for a, _, c, d in SIDES
]


def box(size, middle=(0, 0, 0), angle=0.0):
    """The corners of a box that is turned about the vertical."""
    corners = SIGNS * np.array(size) / 2
    corners[:, :2] = turned(corners[:, :2], angle)
    return corners + middle


def obj(*bodies, faces=TRIANGLES):
    """Bodies of eight corners, or of those that the faces name."""
    lines, count = [], 1
    for corners in bodies:
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
        lines += [f"f {a + count} {b + count} {c + count}" for a, b, c in faces]
        count += len(corners)
    return "\n".join([*lines, ""])


def stl(corners):
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[i]) for i in triangle)
        + "endloop\nendfacet\n"
        for triangle in TRIANGLES
    )
    return f"solid box\n{facets}endsolid box\n"


def dae(corners, unit):
    numbers = " ".join(map(str, np.ravel(corners)))
    indices = " ".join(map(str, np.ravel(TRIANGLES)))
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="any" meter="{unit}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">{numbers}</float_array>
<technique_common><accessor source="#a" count="8" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{indices}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


def mesh(uri="thing.obj", more=""):
    return f"<mesh>\n<uri>{uri}</uri>{more}</mesh>"


def load(folder, shape=None, meshes="boxes", pose="0 0 0 0 0 0"):
    text = world(model(collision(shape or mesh(), pose=pose)))
    return load_world(saved(folder, text), meshes)


def in_order(corners):
    rounded = np.round(corners, 6)
    return corners[np.lexsort(rounded.T)]


def assert_same(corners, expected, atol=1e-6):
    np.testing.assert_allclose(
        in_order(corners), in_order(np.asarray(expected)), rtol=0, atol=atol
    )


def test_a_mesh_is_refused_with_what_to_set(tmp_path):
    saved(tmp_path, obj(box((1, 1, 1))), "thing.obj")
    text = world(model(collision(mesh(), "statue")))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(
        f"line {line_of(text, '<collision')}: collision 'statue' is a mesh"
    )
    assert "set meshes=boxes or meshes=hulls" in fault


@pytest.mark.parametrize("meshes", ["boxes", "hulls"])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("thing.obj", obj),
        ("THING.OBJ", obj),
        ("thing.stl", stl),
        ("thing.dae", lambda corners: dae(corners, 1)),
        ("thing.dae", lambda corners: dae(corners / 0.0254, 0.0254)),
    ],
)
def test_a_turned_box_becomes_that_box(tmp_path, name, text, meshes):
    corners = box((2.0, 1.0, 0.5), (3, 1, 0.25), 0.3)
    saved(tmp_path, text(corners), name)
    (found,) = load(tmp_path, mesh(name), meshes).obstacles
    # STL and COLLADA are read in single precision.
    assert_same(found.corners, corners, 1e-5)
    assert found.name == "wall"


def test_each_part_that_is_not_connected_becomes_a_box(tmp_path):
    table = [
        box((1.2, 0.8, 0.04), (0, 0, 0.72)),
        *(
            box((0.05, 0.05, 0.7), (x, y, 0.35))
            for x in (-0.5, 0.5)
            for y in (-0.3, 0.3)
        ),
    ]
    saved(tmp_path, obj(*table), "thing.obj")
    for meshes in ("boxes", "hulls"):
        found = load(tmp_path, meshes=meshes).obstacles
        assert len(found) == 5
        for leg in table:
            assert any(
                np.allclose(in_order(o.corners), in_order(leg), atol=1e-6)
                for o in found
            )


def test_a_slanted_body_becomes_its_hull_or_the_box_around_it(tmp_path):
    pyramid = np.array(
        [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1.5]]
    )
    faces = [(0, 2, 1), (0, 3, 2), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    saved(tmp_path, obj(pyramid, faces=faces), "thing.obj")
    hull = load(tmp_path, meshes="hulls")
    assert_same(hull.obstacles[0].corners, pyramid)
    assert type(hull.geometries[0].shape()).__name__ == "Convex"
    # Half as high, half as wide.
    assert_same(
        in_order(hull.obstacles[0].outline(0.75, 0.75)),
        [[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]],
    )
    boxes = load(tmp_path, meshes="boxes")
    assert type(boxes.geometries[0].shape()).__name__ == "Box"
    around = ConvexHull(boxes.obstacles[0].corners)
    depth = around.equations[:, :3] @ pyramid.T + around.equations[:, 3:]
    assert depth.max() < 1e-9
    # It is no larger than the upright one.
    assert around.volume <= 2 * 2 * 1.5


@pytest.mark.parametrize("meshes", ["boxes", "hulls"])
def test_scale_and_pose_of_a_collision_move_its_mesh(tmp_path, meshes):
    saved(tmp_path, obj(box((1, 1, 1), (2, 0, 0))), "thing.obj")
    scaled = mesh(more="<scale>3 1 0.5</scale>")
    pose = "10 20 30 0 0 1.5707963267948966"
    (found,) = load(tmp_path, scaled, meshes, pose).obstacles
    # 6 m ahead, which is along y.
    assert_same(found.corners, box((1, 3, 0.5), (10, 26, 30)))


def test_a_body_without_thickness_gets_a_millimetre(tmp_path):
    sheet = np.array([[0, 0, 1], [2, 0, 1], [2, 1, 1], [0, 1, 1]])
    faces = [(0, 1, 2), (0, 2, 3)]
    saved(tmp_path, obj(sheet, faces=faces), "thing.obj")
    for meshes in ("boxes", "hulls"):
        (found,) = load(tmp_path, meshes=meshes).obstacles
        assert_same(found.corners, box((2, 1, 0.001), (1, 0.5, 1)))


def test_contact_and_drawing_have_what_the_map_has(tmp_path):
    saved(tmp_path, obj(box((1, 1, 1)), box((1, 1, 1), (3, 0, 0))), "thing.obj")
    text = world(model(collision(mesh()) + visual(mesh())))
    found = load_world(saved(tmp_path, text), "boxes")
    touched = [g for g in found.geometries if g.proximity_properties()]
    drawn = [g for g in found.geometries if g.illustration_properties()]
    for geometries in (touched, drawn):
        places = [g.pose().translation()[0] for g in geometries]
        np.testing.assert_allclose(sorted(places), [0, 3], atol=1e-6)
    assert len(found.obstacles) == 2


@pytest.mark.parametrize(
    "uri",
    ["model://art/meshes/thing.obj", "file://models/art/meshes/thing.obj"],
)
def test_a_mesh_is_found_as_a_model_is(tmp_path, uri):
    saved(tmp_path / "models/art/meshes", obj(box((1, 1, 1))), "thing.obj")
    assert len(load(tmp_path, mesh(uri)).obstacles) == 1


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("other.obj", "", "'thing.obj' is not found"),
        ("thing.obj", "", "thing.obj"),
        ("thing.obj", "v 1 2\nf 1 2 3\n", "thing.obj"),
        (
            "thing.obj",
            obj(box((2, 1, 1))).replace("v 1.0", "v inf"),
            "thing.obj",
        ),
        ("thing.dae", "<COLLADA", "thing.dae is no mesh that can be read"),
        ("thing.glb", "", "thing.glb is none of .dae, .obj, .stl"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_refused_with_its_line(
    tmp_path, name, text, words
):
    saved(tmp_path, text, name)
    uri = "thing.obj" if name == "other.obj" else name
    text = world(model(collision(mesh(uri), "statue")))
    (fault,) = faults(saved(tmp_path, text), "boxes")
    assert fault.startswith(
        f"line {line_of(text, '<mesh')}: mesh of collision 'statue': "
    )
    assert words in fault


@pytest.mark.parametrize(
    ("package", "name"), [("trimesh", "thing.obj"), ("collada", "thing.dae")]
)
def test_a_reader_that_is_not_installed_is_named(
    tmp_path, monkeypatch, package, name
):
    monkeypatch.setitem(sys.modules, package, None)
    saved(tmp_path, obj(box((1, 1, 1))), name)
    (fault,) = faults(
        saved(tmp_path, world(model(collision(mesh(name))))), "boxes"
    )
    assert f"needs {package}: pip install 'drake_mobarm[meshes]'" in fault


def test_a_part_of_a_mesh_by_its_name_is_refused(tmp_path):
    shape = mesh(more="<submesh><name>lid</name></submesh>")
    (fault,) = faults(saved(tmp_path, world(model(collision(shape)))), "boxes")
    assert "<submesh>" in fault


def test_a_mesh_of_too_many_parts_is_refused(tmp_path):
    corners = np.eye(3) + 3.0 * np.arange(2001)[:, None, None]
    for count, words in ((2000, None), (2001, "has 2001 parts")):
        text = obj(*corners[:count], faces=[(0, 1, 2)])
        saved(tmp_path, text, f"{count}.obj")
        text = world(model(collision(mesh(f"{count}.obj"))))
        path = saved(tmp_path, text, f"{count}.sdf")
        if words is None:
            assert len(load_world(path, "boxes").obstacles) == count
        else:
            (fault,) = faults(path, "boxes")
            assert words in fault


# What is only drawn


def drawn(folder, inside, meshes="refuse"):
    found = load_world(saved(folder, world(model(inside))), meshes)
    shown = [g for g in found.geometries if g.illustration_properties()]
    return [(g.name(), type(g.shape()).__name__) for g in shown]


@pytest.mark.parametrize(
    "shape", [mesh("gone.dae"), "<heightmap/>", "<torus/>"]
)
def test_where_a_visual_cannot_be_drawn_the_links_collisions_are(
    tmp_path, shape
):
    text = collision(BOX, "seat") + visual(BOX, "cloth") + visual(shape)
    assert drawn(tmp_path, text) == [("seat", "Box")]


def test_visuals_that_can_be_drawn_are(tmp_path):
    ball = "<sphere><radius>1</radius></sphere>"
    text = collision(BOX, "seat") + visual(ball, "cloth")
    assert drawn(tmp_path, text) == [("cloth", "Sphere")]
    plane = visual("<plane><normal>1 0 0</normal></plane>") + visual("<empty/>")
    assert drawn(tmp_path, text + plane) == [("cloth", "Sphere")]


def test_a_mesh_that_is_all_there_is_of_a_link_is_refused_or_drawn(tmp_path):
    saved(tmp_path, obj(box((1, 1, 1))), "thing.obj")
    text = visual(mesh(), "lamp")
    (fault,) = faults(saved(tmp_path, world(model(text))))
    assert "visual 'lamp' is a mesh" in fault
    assert drawn(tmp_path, text, "boxes") == [("lamp", "Box")]


# The key of the scenarios


def test_meshes_is_a_key_of_a_scenario(tmp_path):
    saved(tmp_path, obj(box((1, 1, 1), (3, 0, 0.5))), "thing.obj")
    path = saved(tmp_path, world(model(collision(mesh()))))
    places = {
        "homing": ["start=[0, 0, 0]", "beacon=[5, 1]"],
        "placement": ["start=[0, 0, 0]", "target=[3, -0.6, 0.8]"],
    }
    for job, overrides in places.items():
        chosen = [f"world={path}", *overrides]
        with pytest.raises(WorldError, match="meshes=boxes"):
            load_scenario(job, chosen)
        for meshes in ("boxes", "hulls"):
            scenario = load_scenario(job, [*chosen, f"meshes={meshes}"])
            assert scenario.meshes == meshes
        with pytest.raises(ParameterError, match="refuse, boxes, hulls"):
            load_scenario(job, [*chosen, "meshes=cubes"])
    with pytest.raises(WorldError, match="refuse, boxes, hulls"):
        load_world(path, "cubes")
