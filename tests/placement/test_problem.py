"""Targets, and the problems that are asked for them."""

import math

import numpy as np
import pytest

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.planner import PlannerParameters
from drake_mobarm.placement.problem import ToolTarget, turns_freely
from helpers.refusals import assert_refused
from helpers.stands import OBJECTIVE, OPEN, TARGET, limited, problem_of

# Targets


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("position", [0.0, 0.0]),
        ("position", [[0.0, 0.0, 0.5]]),
        ("position", 0.5),
        ("position", "here"),
        ("position", ["x", "y", "z"]),
        ("position", None),
        ("position", [0.0, math.nan, 0.5]),
        ("position", [0.0, math.inf, 0.5]),
        ("position", [0.0, 0.0, -0.01]),
        ("approach", [1.0, 0.0]),
        ("approach", [[1.0, 0.0, 0.0]]),
        ("approach", "forward"),
        ("approach", [0.0, 0.0, 0.0]),
        ("approach", [1.0, 0.0, 0.1]),
        ("approach", [0.0, 0.0, -2.0]),
        ("approach", [math.nan, 0.0, 1.0]),
        ("approach", [1.0, math.inf, 0.0]),
    ],
)
def test_target_that_makes_no_sense_is_refused_by_name(field, value):
    good = {"position": [0.0, 0.0, 0.5], "approach": [1.0, 0.0, 0.0]}
    with pytest.raises(ParameterError, match=rf"\b{field} is .*: valid is "):
        ToolTarget(**{**good, field: value})


def test_target_on_the_floor_is_valid():
    target = ToolTarget(position=(1, 2, 0), approach=(0, 0, -1))
    np.testing.assert_array_equal(target.p_WT, [1.0, 2.0, 0.0])
    np.testing.assert_array_equal(target.a_W, [0.0, 0.0, -1.0])


def test_target_keeps_its_figures_when_what_it_was_made_from_changes():
    position = np.array([1.0, 2.0, 0.5])
    target = ToolTarget(position=position, approach=[1.0, 0.0, 0.0])
    position[0] = 9.0
    assert target.p_WT[0] == 1.0


# Problems


@pytest.mark.parametrize("heading", [math.nan, math.inf, -math.inf])
def test_heading_that_is_not_finite_is_refused(heading):
    assert_refused("heading", problem_of, TARGET, heading=heading)


@pytest.mark.parametrize(
    ("height", "surroundings", "least"),
    [
        # The chassis is 0.2965 m high, the links are 0.04 m thick, and the
        # robot's radius is 0.27 m.
        (0.336, Surroundings([]), 0.31),
        (0.337, Surroundings([]), 0.0),
        (0.336, None, 0.0),
    ],
)
def test_robot_keeps_off_a_target_as_low_as_itself_where_it_must_not_touch(
    height, surroundings, least
):
    target = ToolTarget(position=[1.0, 2.0, height], approach=[0, 0, -1])
    problem = problem_of(target, surroundings=surroundings)
    assert problem.least_distance == pytest.approx(least)


def test_target_moved_on_the_floor_plan_keeps_height_approach_and_the_rest():
    surroundings = Surroundings([])
    problem = problem_of(TARGET, heading=0.3, surroundings=surroundings)
    moved = problem.with_target_at(np.array([3.0, -2.0]))
    np.testing.assert_array_equal(moved.target.p_WT, [3.0, -2.0, 0.4])
    np.testing.assert_array_equal(moved.target.a_W, [0.48, -0.36, -0.8])
    assert moved.objective is OBJECTIVE
    assert moved.free is OPEN
    assert moved.heading == 0.3
    assert moved.surroundings is surroundings
    np.testing.assert_array_equal(problem.target.p_WT, [-1.0, 0.5, 0.4])


def test_problem_without_collisions_has_no_surroundings_and_the_same_rest():
    problem = problem_of(TARGET, heading=0.3, surroundings=Surroundings([]))
    blind = problem.without_collisions()
    assert blind.surroundings is None
    assert blind.target is TARGET
    assert blind.heading == 0.3


def test_joint_turns_freely_where_its_limits_are_a_turn_apart():
    # The WidowX's waist and forearm roll are; the waist here is not.
    np.testing.assert_array_equal(
        turns_freely(OBJECTIVE.arm), [True, False, False, True, False]
    )
    np.testing.assert_array_equal(
        turns_freely(limited(joint_1=(-3.0, 3.0)).arm),
        [False, False, False, True, False],
    )


@pytest.mark.parametrize(
    ("field", "value"),
    [
        *(("replan_distance", x) for x in (-0.01, math.nan, math.inf)),
        *(("delay", x) for x in (-0.01, math.nan, math.inf)),
        *(("rate", x) for x in (0.0, -1.0, math.nan, math.inf)),
    ],
)
def test_planner_parameter_out_of_its_range_is_refused_by_name(field, value):
    assert_refused(field, PlannerParameters, **{field: value})
