"""The best stand, against dense searches and forward kinematics."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.geometry import rotation, wrap_angle
from drake_mobarm.placement.best_stand import find_best_stand
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import plain_grid
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.objective_map import score_places
from drake_mobarm.placement.problem import ToolTarget
from drake_mobarm.robot import APPENDIX_C, ArmKinematics
from drake_mobarm.robot.shape import (
    ARM_BASE_HEIGHT,
    HEIGHTS,
    LINK_RADIUS,
    RADIUS,
)
from drake_mobarm.world.obstacles import (
    Obstacle,
    box_corners,
    clearance,
    outlines,
)
from drake_mobarm.world.sdf import load_world
from helpers.shapes import rectangle
from helpers.stands import (
    ARM,
    OBJECTIVE,
    OPEN,
    PLAIN,
    SMOOTH,
    TARGET,
    lattice,
    limited,
    problem_of,
    random_target,
)

pytestmark = pytest.mark.filterwarnings("error")

HOUSE_START = (-8.0, -2.6)


def dense(problem):
    """The least objective over free places a centimetre apart."""
    places = lattice(problem.target)
    places = places[problem.free.contains(places)]
    scored = score_places(problem, places)
    return np.min(scored.best[~np.isnan(scored.best)], initial=np.inf)


def find_stand(problem):
    """The best stand, searched without a map."""
    return find_best_stand(problem, score_places(problem, np.empty((0, 2))))


def assert_reaches(stand, target, arm=ARM):
    X_BT = arm.forward(stand.q)
    R = rotation(stand.pose[2])
    tip = np.array([*stand.pose[:2], ARM_BASE_HEIGHT])
    tip[:2] += R @ X_BT[:2, 3]
    tip[2] += X_BT[2, 3]
    approach = np.array([*(R @ X_BT[:2, 0]), X_BT[2, 0]])
    np.testing.assert_allclose(tip, target.p_WT, atol=1e-6)
    np.testing.assert_allclose(approach, target.a_W, atol=1e-6)
    assert np.all((stand.q >= arm.lower) & (stand.q <= arm.upper))


def hall(names, *shapes):
    """Open floor but for obstacles of these names."""
    return FreeSpace.from_outlines(
        shapes, RADIUS, (-2.9, -2.9), ((-3, -3), (3, 3)), names
    )


# The best stand


@pytest.mark.parametrize("seed", range(8))
def test_stand_on_open_floor_is_as_good_as_a_dense_search_finds(seed):
    rng = np.random.default_rng(seed)
    target = random_target(rng)
    problem = problem_of(target)
    best = dense(problem)
    stand, reason = find_stand(problem)
    if math.isinf(best):
        assert stand is None
        assert reason.startswith("not reachable")
        return
    assert stand.scores.objective <= 1.01 * best
    assert_reaches(stand, target)


def test_most_of_those_targets_are_reachable():
    found = [
        dense(problem_of(random_target(np.random.default_rng(seed))))
        for seed in range(8)
    ]
    assert np.sum(np.isfinite(found)) >= 5


@pytest.mark.parametrize(
    "parameters",
    [
        replace(PLAIN, torque_weight=0.0, position_weight=0.0),
        replace(PLAIN, position_weight=0.0, attitude_weight=0.0),
        SMOOTH,
        replace(SMOOTH, singularity=0.0),
    ],
    ids=["attitude", "torque", "odd", "no_singularity"],
)
def test_stand_is_as_good_as_a_dense_search_whatever_counts(parameters):
    objective = PlacementObjective(ARM, parameters)
    target = ToolTarget(position=[0.3, -0.4, 0.45], approach=[0.6, 0, -0.8])
    problem = problem_of(target, objective=objective)
    stand, _ = find_stand(problem)
    assert stand.scores.objective <= 1.01 * dense(problem)
    assert_reaches(stand, target)


def test_appendix_c_arm_has_its_best_stand_as_well():
    arm = ArmKinematics(APPENDIX_C)
    objective = PlacementObjective(arm, PLAIN)
    # Its tool lies across the arm's plane wherever the wrist's roll is 0.
    target = ToolTarget(position=[0.3, -0.4, 0.45], approach=[0.6, 0.8, 0])
    problem = problem_of(target, objective=objective)
    stand, _ = find_stand(problem)
    best = dense(problem)
    assert np.isfinite(best)
    assert stand.scores.objective <= 1.01 * best
    assert_reaches(stand, target, arm)


@pytest.fixture(scope="module")
def house():
    world = load_world("small_house")
    free = FreeSpace.of_world(world, HOUSE_START, RADIUS, HEIGHTS)
    return (
        free,
        plain_grid(free, 0.2),
        outlines(world.obstacles, *HEIGHTS),
    )


@pytest.mark.parametrize("seed", range(12))
def test_stand_in_a_house_is_free_and_no_worse_than_the_best_square(
    house, seed
):
    free, grid, shapes = house
    low, high = np.reshape(free.polygon.bounds, (2, 2))
    target = random_target(np.random.default_rng(seed), low, high)
    problem = problem_of(target, free)
    squares = score_places(problem, grid.centres)
    stand, reason = find_best_stand(problem, squares)
    if stand is None:
        assert np.isnan(squares.best).all()
        assert reason.startswith("not reachable")
        return
    best = np.min(squares.best[~np.isnan(squares.best)], initial=np.inf)
    assert stand.scores.objective <= best
    assert_reaches(stand, target)
    assert free.contains(stand.pose[:2])
    assert clearance(shapes, stand.pose[:2]) >= RADIUS - 2e-9


def test_square_that_is_better_than_all_else_is_the_stand():
    # Whatever squares the caller gives, their objective is not worked out anew.
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    problem = problem_of(target)
    squares = score_places(problem, lattice(target, 0.2))
    better = replace(squares, objective=0.01 * squares.objective)
    stand, _ = find_best_stand(problem, better)
    index = np.nanargmin(better.best)
    np.testing.assert_array_equal(stand.pose[:2], better.places[index])


def test_scores_are_those_of_the_stands_joints():
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    stand, reason = find_stand(problem_of(target))
    turned = stand.q + stand.pose[2] * np.eye(6)[0]
    expected = OBJECTIVE.scores(turned)
    assert stand.scores.objective == pytest.approx(float(expected.objective))
    assert f"objective {float(expected.objective):.3f}" in reason


def test_same_input_gives_the_same_stand_twice():
    one, other = (find_stand(problem_of(TARGET)) for _ in range(2))
    np.testing.assert_array_equal(one[0].pose, other[0].pose)
    np.testing.assert_array_equal(one[0].q, other[0].q)
    assert one[1] == other[1]


@pytest.mark.parametrize("width", [0.1, 0.01, 0.001])
def test_free_strip_that_holds_no_square_is_found(width):
    # Between two rows of the places that are tried, 0.025 m apart.
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    x = -0.3625
    strip = FreeSpace.from_outlines(
        [], 0.0, (x, 0), ((x - width / 2, -1), (x + width / 2, 1))
    )
    stand, _ = find_stand(problem_of(target, strip))
    assert strip.contains(stand.pose[:2])
    assert_reaches(stand, target)


# Active constraints


def test_stand_without_active_constraints_says_so():
    stand, reason = find_stand(problem_of(TARGET))
    assert stand.active == ()
    assert reason.startswith("stand at (")
    assert reason.endswith("held by nothing")


def test_table_that_keeps_the_robot_away_is_named():
    # Without the table the robot would stand on its near half.
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    free = hall(
        ["table", "shelf"],
        rectangle(-0.2, -0.8, 0.6, 0.8),
        rectangle(1.5, -1, 2, 1),
    )
    anywhere, _ = find_stand(problem_of(target))
    assert not free.contains(anywhere.pose[:2])
    problem = problem_of(target, free)
    stand, reason = find_stand(problem)
    assert stand.active == ("table, 0.27 m away",)
    assert reason.endswith("held by table, 0.27 m away")
    assert stand.scores.objective > anywhere.scores.objective
    assert stand.scores.objective <= 1.01 * dense(problem)


@pytest.mark.parametrize("joint", [2, 3, 5])
def test_joint_whose_limit_is_in_the_way_is_named(joint):
    names = {2: "shoulder", 3: "elbow", 5: "wrist angle"}
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    q = find_stand(problem_of(target))[0].q[joint - 1]
    # A range that ends short of where the joint would be, on either side.
    objective = limited(**{f"joint_{joint}": (-abs(q) + 0.1, abs(q) - 0.1)})
    problem = problem_of(target, objective=objective)
    stand, reason = find_stand(problem)
    assert any(names[joint] in line for line in stand.active), reason
    assert names[joint] in reason
    assert_reaches(stand, target, objective.arm)
    assert stand.scores.objective <= 1.01 * dense(problem)


def test_robot_stands_beside_a_target_as_low_as_itself_and_says_so():
    # Without surroundings its chassis may be right where the target is.
    target = ToolTarget(position=[0, 0, 0.3], approach=[0, 0, -1])
    on_it, reason = find_stand(problem_of(target))
    assert np.hypot(*on_it.pose[:2]) < RADIUS
    assert "the target, which" not in reason
    problem = problem_of(target, surroundings=Surroundings([]))
    stand, reason = find_stand(problem)
    assert np.hypot(*stand.pose[:2]) >= RADIUS + LINK_RADIUS
    assert "the target, which is as low as the robot" in reason
    assert_reaches(stand, target)


def test_stand_whose_arm_touches_nothing_is_as_good_as_a_dense_search_finds():
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    # Where the arm would be.
    corners = box_corners(np.array([0.05, 2.0, 0.05]))
    beam = Obstacle("beam", np.array([-0.1, 0.0, 0.6]) + corners)
    problem = problem_of(target, surroundings=Surroundings([beam]))
    scored = score_places(problem, lattice(target))
    best = scored.best[~np.isnan(scored.best)].min()
    assert best > 1.05 * dense(problem_of(target))
    stand, _ = find_stand(problem)
    assert stand.scores.objective <= 1.01 * best
    assert_reaches(stand, target)


# Headings


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
def test_heading_that_is_given_is_kept(heading):
    stand, _ = find_stand(problem_of(TARGET, heading=heading))
    assert wrap_angle(stand.pose[2] - heading) == pytest.approx(0, abs=1e-9)
    assert_reaches(stand, TARGET)


def test_robot_that_may_turn_faces_its_target():
    stand, _ = find_stand(problem_of(TARGET))
    x, y = TARGET.p_WT[:2] - stand.pose[:2]
    assert stand.pose[2] == pytest.approx(math.atan2(y, x), abs=1e-9)


def test_robot_that_may_turn_makes_up_for_a_narrow_waist():
    objective = limited(joint_1=(2.0, 2.4))
    wide, _ = find_stand(problem_of(TARGET))
    stand, _ = find_stand(problem_of(TARGET, objective=objective))
    assert 2.0 <= stand.q[0] <= 2.4
    assert stand.active == ()
    assert_reaches(stand, TARGET, objective.arm)
    assert stand.scores.objective == pytest.approx(
        float(wide.scores.objective), rel=1e-6
    )


def test_waist_that_a_given_heading_brings_to_its_limit_is_named():
    objective = limited(joint_1=(-0.3, 0.3))
    target = ToolTarget(position=[0, 0, 0.4], approach=[0.6, 0, -0.8])
    problem = problem_of(target, objective=objective, heading=2.0)
    stand, reason = find_stand(problem)
    assert stand.scores.objective <= 1.01 * dense(problem)
    assert_reaches(stand, target, objective.arm)
    assert stand.active == ("the waist's upper limit, 0.300 rad",)
    assert reason.endswith(f"held by {stand.active[0]}")


# Why there is none


@pytest.mark.parametrize(
    ("position", "approach", "free", "why"),
    [
        ([0, 0, 1.5], [1, 0, 0], OPEN, r"is 1\.09 m above the shoulder"),
        # From above: the wrist would be at 1.1 m.
        ([0, 0, 0.95], [0, 0, -1], OPEN, "no solution of the arm along"),
        (
            [0, 0, 0.5],
            [1, 0, 0],
            hall(["block"], rectangle(-1, -1, 1, 1)),
            "none of them is free and open to the robot",
        ),
        (
            [2.5, 2.5, 0.5],
            [1, 0, 0],
            # A closed-off corner of the floor.
            hall(
                ["a", "b"],
                rectangle(1.4, 1.3, 3, 1.4),
                rectangle(1.3, 1.3, 1.4, 3),
            ),
            "none of them is free and open to the robot",
        ),
    ],
    ids=["high", "approach", "hemmed in", "closed off"],
)
def test_target_that_is_out_of_reach_has_no_stand_and_a_reason(
    position, approach, free, why
):
    target = ToolTarget(position=position, approach=approach)
    problem = problem_of(target, free)
    assert math.isinf(dense(problem))
    stand, reason = find_stand(problem)
    assert stand is None
    assert reason.startswith("not reachable: the target at (")
    with pytest.raises(AssertionError, match=why):
        raise AssertionError(reason)
