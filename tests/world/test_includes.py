"""What a world includes: where it is found, and the same checks for it."""

import os
from pathlib import Path

import numpy as np
import pytest

from drake_mobarm.world.sdf import load_world
from helpers.sdf import (
    collision,
    faults,
    line_of,
    model,
    saved,
    world,
)

ROOT = '<sdf version="1.6">\n{}</sdf>\n'


def included(uri, inside=""):
    return f"<include>\n<uri>{uri}</uri>\n{inside}</include>\n"


def chair(folder, inside=None, name="chair", static="true"):
    """Saves the folder of a model, as Gazebo has them."""
    inside = collision(name="seat") if inside is None else inside
    saved(
        folder / name,
        "<model><name>Chair</name>"
        '<sdf version="1.4">old.sdf</sdf><sdf version="1.10">new.sdf</sdf>'
        '<sdf version="1.6">middle.sdf</sdf></model>',
        "model.config",
    )
    text = ROOT.format(model(inside, name, static=static))
    return saved(folder / name, text, "new.sdf")


def names(path):
    return [o.name for o in load_world(path).obstacles]


@pytest.mark.parametrize(
    "folder", [".", "models", "../models", "worlds/../../models"]
)
@pytest.mark.parametrize(
    "uri", ["model://chair", "model://chair/new.sdf", "package://chair"]
)
def test_a_model_is_found_in_the_folders_beside_a_world(tmp_path, folder, uri):
    (tmp_path / "worlds" / "worlds").mkdir(parents=True)
    chair(tmp_path / "worlds" / folder)
    path = saved(tmp_path / "worlds", world(included(uri)))
    assert names(path) == ["seat"]


@pytest.mark.parametrize(
    "variable", ["GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH"]
)
def test_a_model_is_found_in_the_folders_of_gazebos_variables(
    tmp_path, monkeypatch, variable
):
    chair(tmp_path / "mine")
    folders = ["", "/no/such/folder", str(tmp_path / "mine")]
    monkeypatch.setenv(variable, os.pathsep.join(folders))
    path = saved(tmp_path / "worlds", world(included("model://chair")))
    assert names(path) == ["seat"]


@pytest.mark.parametrize("form", ["{}", "file://{}", "FILE"])
def test_a_model_is_found_by_its_path(tmp_path, form):
    file = chair(tmp_path / "far away")
    uri = form.format(file)
    if form == "FILE":
        uri = "file://../far away/chair/new.sdf"
    path = saved(tmp_path / "worlds", world(included(uri)))
    assert names(path) == ["seat"]
    relative = included("../far away/chair")
    assert names(saved(tmp_path / "worlds", world(relative))) == ["seat"]


def test_a_folder_without_a_list_of_versions_has_its_model_in_model_sdf(
    tmp_path,
):
    text = ROOT.format(model(collision(name="seat"), "chair"))
    saved(tmp_path / "chair", text, "model.sdf")
    assert names(saved(tmp_path, world(included("chair")))) == ["seat"]


def test_a_pose_and_a_name_of_an_include_replace_those_of_the_model(tmp_path):
    chair(tmp_path)
    pose = "<pose>5 6 7 0 0 0</pose>\n<name>{}</name>"
    text = world(
        included("chair", pose.format("one")),
        included("chair", pose.replace("5", "8").format("two")),
    )
    one, two = load_world(saved(tmp_path, text)).obstacles
    np.testing.assert_allclose(one.corners.mean(axis=0), (5, 6, 7))
    np.testing.assert_allclose(two.corners.mean(axis=0), (8, 6, 7))


def test_an_include_may_let_a_model_stand_still_and_may_not_let_it_move(
    tmp_path,
):
    chair(tmp_path, static="false")
    still = included("chair", "<static>true</static>")
    assert names(saved(tmp_path, world(still))) == ["seat"]
    file = tmp_path / "chair" / "new.sdf"
    moves = f"{file} line 2: model 'chair' can move"
    (fault,) = faults(saved(tmp_path, world(included("chair"))))
    assert fault.startswith(moves)
    chair(tmp_path)
    text = world(included("chair", "<static>false</static>"))
    (fault,) = faults(saved(tmp_path, text))
    assert fault.startswith(moves)


def test_models_are_included_in_models_and_merged_into_them(tmp_path):
    file = chair(tmp_path)
    text = Path(file).read_text().replace("building", "frame")
    Path(file).write_text(text)
    room = model(collision(), "room").replace(
        "</model>",
        included("chair", "<name>other</name><pose>3 0 0 0 0 0</pose>")
        + included("chair", "<pose>6 0 0 0 0 0</pose>").replace(
            "<include", '<include merge="true"'
        )
        + "</model>",
    )
    found = load_world(saved(tmp_path, world(room))).obstacles
    places = sorted(o.corners.mean(axis=0)[0].round(6) for o in found)
    assert places == [0, 3, 6]


def test_an_included_file_includes_others_from_its_own_folder(tmp_path):
    inner = ROOT.format(model(collision(name="leg"), "leg"))
    saved(tmp_path / "far" / "chair" / "parts", inner, "leg.sdf")
    outer = model(collision(name="seat"), "chair").replace(
        "</model>", included("parts/leg.sdf") + "</model>"
    )
    saved(tmp_path / "far" / "chair", ROOT.format(outer), "model.sdf")
    path = saved(tmp_path, world(included("far/chair")))
    assert sorted(names(path)) == ["leg", "seat"]


@pytest.mark.parametrize("form", ["{}", "file://{}", "chair", "model://chair"])
@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ("<torus/>", "collision 'wall' is a torus"),
        ("<mesh><uri>a.obj</uri></mesh>", "collision 'wall' is a mesh"),
        ("<box><size>-1 1 1</size></box>", "<size> of collision 'wall'"),
        ("<box/>", "box of collision 'wall' has no <size>"),
        ("<sphere><radius>1,5</radius></sphere>", "<radius> of collision"),
    ],
)
def test_an_included_file_is_checked_as_the_world_is(
    tmp_path, form, shape, words
):
    file = chair(tmp_path, collision(shape))
    path = saved(tmp_path, world(included(form.format(file))))
    (fault,) = faults(path)
    assert fault.startswith(f"{file} line ")
    assert words in fault


def test_an_included_capsule_is_a_capsule(tmp_path):
    shape = "<capsule><radius>0.5</radius><length>2</length></capsule>"
    chair(tmp_path, collision(shape))
    path = saved(tmp_path, world(included("chair")))
    (found,) = load_world(path).obstacles
    np.testing.assert_allclose(found.corners.max(axis=0)[2], 1.5)


def test_what_is_not_found_is_told_with_where_was_looked(tmp_path, monkeypatch):
    monkeypatch.setenv("GAZEBO_MODEL_PATH", "/some/models")
    text = world(included("model://gone"), included("/not/here.sdf"))
    gone, here = faults(saved(tmp_path, text))
    assert gone.startswith(
        f"line {line_of(text, '<include')}: <include>: 'model://gone' is not "
        "found in "
    )
    for folder in (tmp_path, tmp_path / "models", "/some/models"):
        assert str(folder) in gone
    assert "GAZEBO_MODEL_PATH" in gone
    assert here.startswith(
        f"line {line_of(text, '<include', 1)}: <include>: '/not/here.sdf' is "
        "not found"
    )


@pytest.mark.parametrize(
    "uri", ["https://fuel.example/chair", "fuel://chair", "ftp://chair"]
)
def test_nothing_is_fetched_from_elsewhere(tmp_path, uri):
    (fault,) = faults(saved(tmp_path, world(included(uri))))
    assert f"{uri!r} is not on this machine" in fault


def test_a_name_of_5000_characters_is_not_found(tmp_path):
    (fault,) = faults(saved(tmp_path, world(included("a" * 5000))))
    assert "is not found" in fault
    assert len(fault) < 1500


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("<sdf", "chair.sdf is not valid XML"),
        ("<robot/>", "chair.sdf line 1: the root is <robot>, not <sdf>"),
        ("<sdf>\n<model/></sdf>", "chair.sdf line 1: <sdf> has no version"),
        (world(model()), "chair.sdf line 2: <sdf> has to hold one <model>"),
    ],
)
def test_an_included_file_that_is_no_model_is_refused_by_its_name(
    tmp_path, file, words
):
    saved(tmp_path, file, "chair.sdf")
    (fault,) = faults(saved(tmp_path, world(included("chair.sdf"))))
    assert words in fault


def test_a_folder_without_its_model_is_refused_by_its_name(tmp_path):
    chair(tmp_path)
    (tmp_path / "chair" / "new.sdf").unlink()
    (fault,) = faults(saved(tmp_path, world(included("chair"))))
    assert fault.endswith("chair, which holds no new.sdf")


def test_files_that_include_each_other_are_refused(tmp_path):
    for one, other in (("a.sdf", "b.sdf"), ("b.sdf", "a.sdf")):
        text = model(collision()).replace(
            "</model>", included(other) + "</model>"
        )
        saved(tmp_path, ROOT.format(text), one)
    (fault,) = faults(saved(tmp_path, world(included("a.sdf"))))
    assert fault.endswith("<include>: 'a.sdf' includes itself")


def test_includes_that_multiply_are_refused(tmp_path):
    # 20 times 20 times 20 times 20 models.
    saved(tmp_path, ROOT.format(model(collision(), "m0")), "0.sdf")
    for level in (1, 2, 3):
        inside = "".join(
            included(f"{level - 1}.sdf", f"<name>m{i}</name>")
            for i in range(20)
        )
        text = model(name=f"m{level}").replace("</model>", inside + "</model>")
        saved(tmp_path, ROOT.format(text), f"{level}.sdf")
    text = "".join(included("3.sdf", f"<name>m{i}</name>") for i in range(20))
    (fault,) = faults(saved(tmp_path, world(text)))
    assert fault == "it includes more than 5000 models"


def test_sun_and_ground_plane_need_no_file(tmp_path):
    height = "<pose>0 0 0.5 0 0 0</pose>"
    text = world(
        included("model://sun"),
        included("model://ground_plane", height),
        model(collision(pose="0 0 3.5 0 0 0")),
    )
    (found,) = load_world(saved(tmp_path, text)).obstacles
    # The box's middle is 3 m above the floor.
    assert found.corners.mean(axis=0)[2] == pytest.approx(3.0)


def test_a_sun_that_is_found_is_no_obstacle(tmp_path):
    saved(tmp_path / "sun", ROOT.format('<light name="sun"/>'), "model.sdf")
    assert names(saved(tmp_path, world(included("model://sun")))) == []


def test_a_world_is_read_anew_when_an_included_file_has_changed(tmp_path):
    file = chair(tmp_path)
    path = saved(tmp_path, world(included("chair")))
    first = load_world(path)
    assert load_world(path) is first
    chair(tmp_path, collision(name="back"))
    os.utime(file, (1, 1))
    assert names(path) == ["back"]
