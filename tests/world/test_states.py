"""A world's `<state>`: applied where it fits its models, else refused."""

import numpy as np
import pytest

from drake_mobarm.world.sdf import load_world
from helpers.sdf import collision, faults, line_of, model, saved, world

QUARTER = "0 0 1.570796"


def state(*inside):
    return (
        '<state world_name="w">\n<sim_time>1 2</sim_time>\n'
        f"{''.join(inside)}</state>\n"
    )


def placed(pose="10 20 0 " + QUARTER, link="", name="house", inside=""):
    link = link and (
        f'<link name="building">\n<pose frame="">{link}</pose>\n'
        "<velocity>0 0 0 0 0 0</velocity></link>\n"
    )
    return (
        f'<model name="{name}">\n<pose>{pose}</pose>\n'
        f"<scale>1 1 1</scale>\n{link}{inside}</model>\n"
    )


HOUSE = model(collision(pose="1 0 0 0 0 0"), pose="5 5 5 0 0 0")


def centre(folder, text):
    (found,) = load_world(saved(folder, text)).obstacles
    return found.corners.mean(axis=0)


def test_models_stand_where_the_state_has_them(tmp_path):
    # 1 m ahead of (10, 20), facing y.
    text = world(HOUSE, state(placed()))
    np.testing.assert_allclose(centre(tmp_path, text), (10, 21, 0), atol=1e-5)


def test_models_that_a_state_does_not_name_stay(tmp_path):
    text = world(HOUSE, state())
    np.testing.assert_allclose(centre(tmp_path, text), (6, 5, 5))


def test_included_models_stand_where_the_state_has_them(tmp_path):
    saved(tmp_path, f'<sdf version="1.6">{HOUSE}</sdf>', "house.sdf")
    include = "<include><uri>house.sdf</uri>{}</include>"
    for name in ("house", "shed"):
        more = f"<name>{name}</name><pose>1 1 1 0 0 0</pose>"
        text = world(
            include.format(more if name == "shed" else ""),
            state(placed(name=name)),
        )
        np.testing.assert_allclose(
            centre(tmp_path, text), (10, 21, 0), atol=1e-5
        )


def test_links_have_to_be_where_their_model_has_them(tmp_path):
    text = world(HOUSE, state(placed(link="10 20 0 " + QUARTER)))
    np.testing.assert_allclose(centre(tmp_path, text), (10, 21, 0), atol=1e-5)
    text = world(HOUSE, state(placed(link="10 20.1 0 " + QUARTER)))
    (fault,) = faults(saved(tmp_path, text))
    assert fault == (
        f"line {line_of(text, '<link', 1)}: <state> places link "
        "'house::building', but its model has it elsewhere: remove <state>"
    )


@pytest.mark.parametrize(
    ("inside", "element", "words"),
    [
        (placed(name="gone"), "<model", "there is no such model: remove"),
        (
            placed(inside=placed(name="inner")),
            '<model name="inner"',
            "it is within model 'house': remove <state>",
        ),
        (
            placed().replace("1 1 1", "2 2 2"),
            "<scale",
            "it has another size there: remove <state>",
        ),
        (
            placed(link="1 1 1 0 0 0").replace("building", "gone"),
            "<link",
            "there is no such link: remove <state>",
        ),
        (
            f"<insertions>\n{HOUSE}</insertions>\n",
            "<insertions",
            "remove <state>",
        ),
        (
            "<deletions><name>house</name></deletions>\n",
            "<deletions",
            "remove <state>",
        ),
        (placed("1,5 0 0 0 0 0"), "<pose>1,5", "<pose> of model 'house' is"),
    ],
)
def test_what_does_not_fit_the_models_is_refused(
    tmp_path, inside, element, words
):
    before = world(HOUSE)
    text = before.replace("</world>", state(inside) + "</world>")
    (fault,) = faults(saved(tmp_path, text))
    offset = line_of(before, "</world>") - 1
    after = text[text.index("<state") :]
    assert fault.startswith(f"line {offset + line_of(after, element)}: ")
    assert words in fault


def test_empty_lists_of_insertions_and_deletions_are_fine(tmp_path):
    text = world(HOUSE, state("<insertions/><deletions></deletions>", placed()))
    assert centre(tmp_path, text)[0] == pytest.approx(10, abs=1e-5)
