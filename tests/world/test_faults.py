"""What is wrong with a world: all of it, by element and line."""

import pytest

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


def test_all_faults_of_a_file_are_in_one_message_in_their_order(tmp_path):
    text = world(
        model(collision("<torus/>", "ring")),
        model(collision(), "chair", static="false"),
        '<actor name="walker"><pose>0 0 0 0 0 0</pose></actor>\n',
        model(collision(pose="1,7 0 0 0 0 0", name="sill"), "window"),
        model(collision("<mesh><uri>a.dae</uri></mesh>", "statue"), "art"),
    )
    ring, chair, actor, pose, mesh = faults(saved(tmp_path, text))
    assert ring.startswith(
        f"line {line_of(text, '<collision')}: collision 'ring' is a torus"
    )
    assert chair == (
        f"line {line_of(text, '<model', 1)}: model 'chair' can move: write "
        "<static>true</static> in it"
    )
    assert actor.startswith(
        f"line {line_of(text, '<actor')}: actor 'walker': it moves"
    )
    assert pose == (
        f"line {line_of(text, '<pose>1,7')}: <pose> of collision 'sill' is "
        "'1,7 0 0 0 0 0': valid is 6 numbers from -1000000 to 1000000"
    )
    assert mesh.startswith(
        f"line {line_of(text, '<collision', 3)}: collision 'statue' is a mesh"
    )
    assert "meshes=boxes" in mesh


def test_of_many_faults_the_first_ten_are_said_and_the_others_counted(
    tmp_path,
):
    shapes = "".join(collision("<torus/>", f"ring_{i}") for i in range(13))
    text = world(model(shapes))
    found = faults(saved(tmp_path, text))
    assert len(found) == 11
    assert [f"'ring_{i}'" in found[i] for i in range(10)] == [True] * 10
    assert found[10] == "and 3 more"


@pytest.mark.parametrize(
    "number",
    ["1,5", "1.5m", "nan", "inf", "1e400", "0x10", "1_0", "one", "١", "1e7"],  # noqa: RUF001
)
@pytest.mark.parametrize(
    ("tag", "text"),
    [
        ("pose", collision(pose="0 0 N 0 0 0")),
        ("size", collision("<box><size>1 N 1</size></box>")),
        (
            "radius",
            collision(
                "<cylinder><radius>N</radius><length>1</length></cylinder>"
            ),
        ),
        (
            "length",
            collision(
                "<capsule><radius>1</radius><length>N</length></capsule>"
            ),
        ),
        ("radius", collision("<sphere><radius>N</radius></sphere>")),
        ("radii", collision("<ellipsoid><radii>1 1 N</radii></ellipsoid>")),
        ("normal", collision("<plane><normal>0 0 N</normal></plane>")),
        ("size", visual("<box><size>1 N 1</size></box>")),
    ],
)
def test_text_in_a_number_field_that_is_no_number_is_refused(
    tmp_path, tag, text, number
):
    text = world(model(text.replace("N", number)))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(f"line {line_of(text, number)}: <{tag}> of ")
    assert number in fault
    assert "valid is" in fault


@pytest.mark.parametrize("number", ["1", "1.", "+1.0", "1e0", "10E-1", ".1e1"])
def test_numbers_are_read_in_every_way_that_they_are_written(tmp_path, number):
    size = f"<box><size>{number} {number}\n\t2</size></box>"
    (found,) = load_world(
        saved(tmp_path, world(model(collision(size))))
    ).obstacles
    assert found.corners.max(axis=0).tolist() == [0.5, 0.5, 1.0]


@pytest.mark.parametrize(
    ("pose", "valid"),
    [
        ("1 2 3", "6 numbers"),
        ("1 2 3 0 0 0 1", "6 numbers"),
        ('" rotation_format="quat_xyzw">1 2 3 0 0 0', "7 numbers"),
        ('" rotation_format="quat_xyzw">1 2 3 0 0 0 0', "a quaternion of 0"),
        ('" rotation_format="matrix">1 2 3 0 0 0', "euler_rpy"),
        ('" degrees="yes">1 2 3 0 0 0', "true or false"),
        ("0 0 0 1e300 0 0", "1000000"),
    ],
)
def test_a_pose_of_another_form_is_refused(tmp_path, pose, valid):
    text = world(model(collision(pose=pose)))
    text = text.replace('<pose>" ', '<pose a="" ')
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(f"line {line_of(text, '<pose', 1)}: <pose> of ")
    assert "collision 'wall'" in fault
    assert valid in fault


@pytest.mark.parametrize(
    ("text", "element", "words"),
    [
        (world(model(), model()), "<model", "model 'house' has the name of"),
        (world(model(name="")), "<model", "<model> has no name"),
        (
            world(model(name="__x__")),
            "<model",
            "'__x__': that name is reserved",
        ),
        (world(model(name="world")), "<model", "that name is reserved"),
        (world(model(name="a::b")), "<model", "no name may have ::"),
        (world(model(name=" ")), "<model", "<model> has no name"),
        (world(model(name="::"), version="1.6"), "<model", "may have ::"),
        (world(model(name="a::"), version="1.6"), "<model", "may have ::"),
        (world(model(static="maybe")), "<static", "valid is true or false"),
        (
            world(
                model(collision("")),
            ),
            "<collision",
            "has no shape",
        ),
        (
            world(model(collision(BOX + "<sphere/>"))),
            "<collision",
            "several shapes, <box>, <sphere>",
        ),
        (world(model(collision("<box/>"))), "<box/>", "has no <size>"),
        (
            world(model("<pose>0 0 0 0 0 0</pose>\n<pose/>\n")),
            "<pose/>",
            "link 'building' has a second <pose>",
        ),
        (
            world('<population name="p"><model/></population>\n'),
            "<population",
            "population 'p': it puts models at random, so",
        ),
        (
            world(model(), "<include>\n<uri>model://gone</uri></include>"),
            "<include",
            "'model://gone' is not found",
        ),
        (
            world(model(), "<include>\n</include>"),
            "<include",
            "<include>: <uri> '' names no file",
        ),
        (
            world('<frame name="f">\n<pose relative_to="gone"/></frame>'),
            '<pose relative_to="gone"',
            "the frame 'gone' that it refers to is not there",
        ),
        (
            world(
                '<frame name="f">\n<pose relative_to="g"/></frame>\n'
                '<frame name="g">\n<pose relative_to="f"/></frame>\n'
            ),
            '<pose relative_to="f"',
            "the frame 'f' that it refers to is not there, or depends on it",
        ),
        (
            world('<frame name="f">\n<pose relative_to="__root__"/></frame>'),
            "<pose",
            "relative_to may not be __root__",
        ),
        (
            world(model()).replace("<pose>", '<pose frame="f">', 1),
            "<pose",
            "relative_to since SDF 1.7",
        ),
        (world(model(), version="2.0"), "<sdf", "version '2.0': valid is 1.2"),
        (world(model(), version="1.99"), "<sdf", "version '1.99'"),
        (world(model(), version="abc"), "<sdf", "version 'abc'"),
        (
            world(model()).replace(' version="1.9"', ""),
            "<sdf",
            "<sdf> has no version: valid is 1.2 to 1.12, as in "
            '<sdf version="1.9">',
        ),
        ('<sdf version="1.9"/>', "<sdf", "and it holds neither"),
        (
            f'<sdf version="1.9">\n{model()}{model(name="b")}</sdf>',
            "<sdf",
            "one <model> or one <world>, and it holds <model>, <model>",
        ),
    ],
)
def test_a_fault_is_told_with_its_element_and_line(
    tmp_path, text, element, words
):
    number = text.count(element) - 1 if words.endswith("the name of") else 0
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(f"line {line_of(text, element, number)}: ")
    assert words in fault


def test_a_model_that_refers_to_its_own_link_is_refused(tmp_path):
    text = world(model()).replace(
        "<pose>", '<pose relative_to="house::building">', 1
    )
    (fault,) = faults(saved(tmp_path, text))
    assert fault == "the frames that its poses refer to depend on themselves"


@pytest.mark.parametrize("name", ["", ' name="world"', ' name="a::b"'])
def test_the_name_in_a_world_is_not_looked_at(tmp_path, name):
    text = world(model(collision())).replace(' name="w"', name)
    assert len(load_world(saved(tmp_path, text)).obstacles) == 1


def test_a_models_collisions_may_have_any_name_or_none(tmp_path):
    shapes = collision(name="c") + collision(name="c") + collision(name="")
    found = load_world(saved(tmp_path, world(model(shapes)))).obstacles
    assert [o.name for o in found] == ["c", "c", "<collision>"]


def test_a_name_may_tell_of_models_within_models_before_sdf_1_8(tmp_path):
    text = world(model(collision(), "table::leg"), version="1.6")
    assert len(load_world(saved(tmp_path, text)).obstacles) == 1


def test_models_within_a_model_that_stands_still_stand_still(tmp_path):
    inner = f'<model name="inner">\n<link name="l">{collision()}</link></model>'
    text = world(
        model(name="outer").replace("</model>", f"{inner}</model>"),
        f'<model name="group">{model(collision(), "inner")}</model>',
    )
    assert len(load_world(saved(tmp_path, text)).obstacles) == 2


def test_what_is_neither_touched_nor_drawn_is_not_looked_at(tmp_path):
    text = world(
        model(
            collision()
            + "<inertial><mass>a lot</mass></inertial>"
            + '<sensor name="s"><collision>gone</collision></sensor>'
        ),
        '<light name="sun" type="directional"><pose>a b c</pose></light>',
        '<physics type="ode"><max_step_size>0,001</max_step_size></physics>',
        "<gravity>0 0 -9,8</gravity><unheard_of/>",
        '<plugin name="p" filename="q"><box><size>-1</size></box></plugin>',
    )
    assert len(load_world(saved(tmp_path, text)).obstacles) == 1


def test_joints_of_a_model_that_stands_still_are_not_looked_at(tmp_path):
    joint = (
        '<joint name="hinge" type="revolute"><parent>building</parent>'
        "<child>gone</child></joint></model>"
    )
    text = world(model(collision()).replace("</model>", joint))
    assert len(load_world(saved(tmp_path, text)).obstacles) == 1


def test_a_wrong_colour_or_friction_is_refused(tmp_path):
    friction = (
        "<surface><friction><ode>\n<mu>0,5</mu></ode></friction></surface>"
    )
    colour = "<material>\n<diffuse>red</diffuse></material>"
    text = world(
        model(
            collision().replace("</collision>", f"{friction}</collision>")
            + visual().replace("</visual>", f"{colour}</visual>")
        )
    )
    mu, diffuse = faults(saved(tmp_path, text))
    assert mu.startswith(
        f"line {line_of(text, '<mu')}: <mu> of collision 'wall' is '0,5'"
    )
    assert diffuse.startswith(
        f"line {line_of(text, '<diffuse')}: <diffuse> of "
    )
