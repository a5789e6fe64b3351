"""Worlds from SDF: what is read, and what is refused."""

import os

import numpy as np
import pytest

from drake_mobarm import load_scenario
from drake_mobarm.diagrams.station import build_station
from drake_mobarm.exceptions import MobarmError, WorldError
from drake_mobarm.station import StationParameters
from drake_mobarm.world.sdf import find_world, load_world, world_names

BOX = "<box><size>2 4 6</size></box>"
STATIC = "<static>true</static>"


def sdf(geometry=BOX, *, static=STATIC, pose="0 0 0 0 0 0", extra=""):
    return (
        '<?xml version="1.0"?>\n<sdf version="1.9"><model name="house">'
        f'{static}<link name="building"><collision name="wall">'
        f"<pose>{pose}</pose><geometry>{geometry}</geometry></collision>"
        f"{extra}</link></model></sdf>"
    )


@pytest.fixture
def write(tmp_path):
    def write_world(text, name="mine.sdf"):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write_world


# Shipped worlds


@pytest.mark.parametrize(
    ("name", "boxes", "cylinders"),
    [
        ("small_house", 218, 8),
        ("bookstore", 282, 17),
        ("cafe", 41, 0),
        ("empty", 0, 0),
    ],
)
def test_shipped_world_has_all_its_obstacles(name, boxes, cylinders):
    corners = [len(o.corners) for o in load_world(name).obstacles]
    assert corners.count(8) == boxes
    assert len(corners) == boxes + cylinders


def test_shipped_worlds_are_all_listed():
    assert world_names() == ["bookstore", "cafe", "empty", "small_house"]


@pytest.mark.parametrize("name", ["small_house", "bookstore", "cafe"])
def test_shipped_worlds_obstacles_stand_on_or_above_the_floor(name):
    for obstacle in load_world(name).obstacles:
        assert obstacle.corners[:, 2].min() > -0.01
        assert obstacle.corners[:, 2].max() > 0.02


@pytest.mark.parametrize("name", ["small_house", "bookstore", "cafe"])
def test_shipped_worlds_obstacles_have_names_of_their_own(name):
    names = [o.name for o in load_world(name).obstacles]
    assert len(set(names)) == len(names)


def test_small_houses_air_conditioner_stands_where_its_file_says():
    (found,) = (
        o
        for o in load_world("small_house").obstacles
        if o.name == "standing_air_conditioner"
    )
    np.testing.assert_allclose(
        found.corners.mean(axis=0), (-2.003, -5.228, 1.013)
    )
    np.testing.assert_allclose(
        np.ptp(found.corners, axis=0), (0.51, 0.409, 2.026)
    )


# Worlds of one's own


def test_box_is_read_with_its_pose(write):
    world = load_world(write(sdf(pose="10 20 30 0 0 1.5707963267948966")))
    (obstacle,) = world.obstacles
    assert obstacle.name == "wall"
    # A quarter turn: 2 m along y, 4 m along x.
    np.testing.assert_allclose(obstacle.corners.min(axis=0), (8, 19, 27))
    np.testing.assert_allclose(obstacle.corners.max(axis=0), (12, 21, 33))


def test_poses_of_model_link_and_collision_add_up(write):
    text = sdf(pose="1 0 0 0 0 0").replace(
        '<link name="building">',
        "<pose>0 100 0 0 0 1.5707963267948966</pose>"
        '<link name="building"><pose>10 0 0 0 0 0</pose>',
    )
    (obstacle,) = load_world(write(text)).obstacles
    # 11 m ahead of a model that faces +y at (0, 100).
    np.testing.assert_allclose(
        obstacle.corners.mean(axis=0), (0, 111, 0), atol=1e-9
    )


def test_lying_cylinder_is_read_as_it_lies(write):
    geometry = "<cylinder><radius>0.5</radius><length>3</length></cylinder>"
    text = sdf(geometry, pose="0 0 0 0 1.5707963267948966 0")
    (obstacle,) = load_world(write(text)).obstacles
    np.testing.assert_allclose(np.ptp(obstacle.corners, axis=0), (3, 1, 1))


def test_world_is_named_after_its_file(write):
    world = load_world(write(sdf(), "attic.sdf"))
    assert world.name == "attic"
    assert world.path.name == "attic.sdf"


def test_models_of_a_world_element_are_all_read(write):
    text = sdf().replace('"1.9">', '"1.9"><world name="w">')
    text = text.replace("</sdf>", "</world></sdf>")
    model = text[text.index("<model") : text.index("</world>")]
    text = text.replace("</world>", model.replace("house", "shed") + "</world>")
    assert len(load_world(write(text)).obstacles) == 2


def test_visuals_are_no_obstacles(write):
    visual = f'<visual name="v"><geometry>{BOX}</geometry></visual>'
    assert len(load_world(write(sdf(extra=visual))).obstacles) == 1


def test_changed_file_is_read_anew(write):
    path = write(sdf())
    before = load_world(path)
    write(sdf(pose="7 0 0 0 0 0"))
    os.utime(path, (1, 1))
    after = load_world(path)
    shift = after.obstacles[0].corners - before.obstacles[0].corners
    np.testing.assert_allclose(shift, np.tile((7, 0, 0), (8, 1)))


# What is refused


@pytest.mark.parametrize(
    "shape", ["mesh", "heightmap", "polyline", "image", "cone", "torus"]
)
def test_other_shape_is_refused_by_its_name(write, shape):
    path = write(sdf(f"<{shape}/>"))
    with pytest.raises(WorldError) as caught:
        load_world(path)
    message = str(caught.value)
    assert f"{path}: line 2: collision 'wall' is a {shape}: valid" in message
    for valid in ("box", "sphere", "cylinder", "capsule", "ellipsoid", "plane"):
        assert valid in message


@pytest.mark.parametrize("static", ["", "<static>false</static>"])
def test_model_that_can_move_is_refused_with_what_to_write(write, static):
    path = write(sdf(static=static))
    with pytest.raises(WorldError) as caught:
        load_world(path)
    assert path in str(caught.value)
    assert "line 2: model 'house' can move" in str(caught.value)
    assert STATIC in str(caught.value)


@pytest.mark.parametrize("text", [sdf()[:-9], "", "no XML at all", "\x00"])
def test_broken_xml_is_refused(write, text):
    path = write(text)
    with pytest.raises(WorldError) as caught:
        load_world(path)
    assert path in str(caught.value)
    assert "not valid XML" in str(caught.value)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "mine.sdf"
    path.write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(WorldError, match="not valid XML"):
        load_world(str(path))


def test_root_that_is_not_sdf_is_refused_by_its_name(write):
    path = write('<robot name="r"/>')
    with pytest.raises(WorldError, match="<robot>, not <sdf>"):
        load_world(path)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (sdf("<box><size>a b c</size></box>"), "size"),
        (sdf("<box><size>1 2</size></box>"), "size"),
        (sdf("<box><size>nan 1 1</size></box>"), "size"),
        (sdf(pose="nan 0 0 0 0 0"), "pose"),
        ('<sdf version="1.9"/>', "model"),
        (
            '<sdf version="1.9"><model name="m"><include><uri>model://gone'
            "</uri></include></model></sdf>",
            "model://gone",
        ),
    ],
)
def test_what_drake_cannot_parse_is_refused_in_one_line(write, text, word):
    path = write(text)
    with pytest.raises(WorldError) as caught:
        load_world(path)
    message = str(caught.value)
    assert path in message
    assert word in message
    assert "\n" not in message


@pytest.mark.parametrize(
    "geometry",
    [
        "<box><size>-1 1 1</size></box>",
        "<box><size>0 1 1</size></box>",
        "<box><size>1e-9 1 1</size></box>",
        "<box><size>1e7 1 1</size></box>",
        "<box/>",
        "<cylinder><radius>-1</radius><length>1</length></cylinder>",
        "<cylinder><radius>1</radius></cylinder>",
        "",
    ],
)
def test_extent_that_is_missing_or_no_length_is_refused(write, geometry):
    with pytest.raises(WorldError, match=r"line 2: .*collision 'wall'"):
        load_world(write(sdf(geometry)))


@pytest.mark.parametrize("encoding", ["klingon", "ISO-8859-1", "utf-16"])
def test_encoding_that_a_file_only_claims_is_not_looked_at(write, encoding):
    text = sdf().replace("?>", f' encoding="{encoding}"?>')
    assert len(load_world(write(text)).obstacles) == 1


@pytest.mark.parametrize(
    "name", ["castle", "", "small_house.sdf", "Small_House", "/no/such.sdf"]
)
def test_unknown_world_is_refused_with_the_valid_ones(name):
    with pytest.raises(WorldError) as caught:
        find_world(name)
    assert repr(name) in str(caught.value)
    for valid in ("bookstore", "cafe", "empty", "small_house"):
        assert valid in str(caught.value)


@pytest.mark.parametrize("ending", ["", ".sdf", ".world"])
def test_a_name_of_5000_characters_is_refused_in_few_words(ending):
    name = "a" * 5000 + ending
    for load in (
        find_world,
        lambda name: load_scenario("homing", [f"world={name}"]),
    ):
        with pytest.raises(WorldError) as caught:
            load(name)
        assert str(caught.value).startswith("unknown world 'aaaa")
        assert len(str(caught.value)) < 250


def test_a_name_with_a_zero_byte_is_unknown():
    with pytest.raises(WorldError, match="unknown world"):
        find_world("a\0b.sdf")


@pytest.mark.parametrize(
    "name", ["a.world", "a.SDF", "a.World", "my house.sdf"]
)
def test_files_of_worlds_have_several_endings(write, name):
    world = load_world(write(sdf(), name))
    assert world.name == name.rpartition(".")[0]


@pytest.mark.parametrize("name", ["a.world", "a.SDF"])
def test_a_world_is_found_beside_the_scenario_that_names_it(
    write, tmp_path, name
):
    write(sdf(pose="0 9 0 0 0 0"), name)
    scenario = tmp_path / "mine.yaml"
    scenario.write_text(
        f"diagram: homing\nworld: {name}\nstart: [0, 0, 0]\nbeacon: [3, 0]\n"
    )
    assert load_scenario(str(scenario)).world == str(tmp_path / name)


def test_folder_and_file_of_another_kind_are_no_worlds(tmp_path):
    (tmp_path / "folder.sdf").mkdir()
    (tmp_path / "world.xml").write_text(sdf())
    for name in ("folder.sdf", "world.xml"):
        with pytest.raises(WorldError, match="unknown world"):
            load_world(str(tmp_path / name))


def test_world_error_is_a_value_error_of_this_library():
    assert issubclass(WorldError, ValueError)
    assert issubclass(WorldError, MobarmError)


def test_names_of_a_file_need_be_neither_unique_nor_other_than_ours(tmp_path):
    models = "".join(
        f'<model name="{model}"><static>true</static><link name="l">'
        f'<collision name="{name}"><pose>{x} 3 0.5 0 0 0</pose><geometry>'
        "<box><size>1 1 1</size></box></geometry></collision></link></model>"
        for model, name, x in (
            ("a", "collision", 0),
            ("b", "collision", 3),
            ("c", "ground", 6),
        )
    )
    file = tmp_path / "hall.sdf"
    file.write_text(
        f'<sdf version="1.9"><world name="w">{models}</world></sdf>'
    )
    world = load_world(str(file))
    assert [o.name for o in world.obstacles] == [
        "collision",
        "collision",
        "ground",
    ]
    station = build_station(world, [0, 0, 0], StationParameters())
    inspector = station.GetSubsystemByName("scene_graph").model_inspector()
    names = [inspector.GetName(i) for i in inspector.GetAllGeometryIds()]
    assert sum("(hall " in name for name in names) == 3
