"""Against dense searches, central differences, and the closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.geometry import rotation, wrap_angle
from drake_mobarm.placement.best_stand import find_best_stand
from drake_mobarm.placement.collision import (
    Surroundings,
)
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import plain_grid
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
)
from drake_mobarm.placement.objective_map import (
    ToolTarget,
    score_places,
)
from drake_mobarm.placement.stand_program import FREE_JOINTS, StandProgram
from drake_mobarm.robot import APPENDIX_C, WIDOWX_250, ArmKinematics
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

pytestmark = pytest.mark.filterwarnings("error")

ARM = ArmKinematics(WIDOWX_250)
OBJECTIVE = PlacementObjective(ARM, ObjectiveParameters())
ODD = ObjectiveParameters(
    torque_weight=0.7,
    position_weight=1.9,
    attitude_weight=0.4,
    singularity=0.0031,
    position_axes=[0.3, -0.8, 2.1],
    position_axis_weights=[1.0, 0.2, 2.5],
    attitude_axes=[-1.2, 0.4, 0.9],
    attitude_axis_weights=[0.2, 3.0, 1.0],
    payload=0.35,
)
OPEN = FreeSpace.from_outlines([], RADIUS, (0, 0), ((-3, -3), (3, 3)))
HOUSE_START = (-8.0, -2.6)
# On open floor its best stand is held by nothing.
TARGET = ToolTarget(position=[-1.0, 0.5, 0.4], approach=[0.48, -0.36, -0.8])


def limited(**limits):
    """The WidowX with other limits: joint_3=(low, high) [rad]."""
    lower, upper = ARM.lower.copy(), ARM.upper.copy()
    for name, (low, high) in limits.items():
        joint = int(name[-1]) - 1
        lower[joint], upper[joint] = low, high
    return PlacementObjective(
        ArmKinematics(replace(WIDOWX_250, lower=lower, upper=upper)),
        OBJECTIVE.parameters,
    )


def random_target(rng, low=(-1.5, -1.5), high=(1.5, 1.5)):
    a = rng.normal(size=3)
    a[2] = -abs(a[2])
    return ToolTarget(
        position=rng.uniform([*low, 0.1], [*high, 0.8]),
        approach=a / np.linalg.norm(a),
    )


def lattice(target, spacing=0.01, reach=0.67):
    steps = np.arange(-reach, reach, spacing)
    x, y = np.meshgrid(steps, steps)
    return target.p_WT[:2] + np.column_stack([x.ravel(), y.ravel()])


def dense(objective, target, free, heading=None):
    """The least objective over free places a centimetre apart."""
    places = lattice(target)
    places = places[free.contains(places)]
    scored = score_places(objective, target, places, heading)
    return np.min(scored.best[~np.isnan(scored.best)], initial=np.inf)


def no_squares(objective, target):
    return score_places(objective, target, np.empty((0, 2)))


def stand_near(target, free, objective=OBJECTIVE, heading=None):
    return find_best_stand(
        objective, target, free, no_squares(objective, target), heading
    )


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


def rectangle(x_low, y_low, x_high, y_high):
    return np.array(
        [(x_low, y_low), (x_high, y_low), (x_high, y_high), (x_low, y_high)],
        dtype=float,
    )


def hall(names, *shapes):
    """Open floor but for obstacles of these names."""
    return FreeSpace.from_outlines(
        shapes, RADIUS, (-2.9, -2.9), ((-3, -3), (3, 3)), names
    )


# The program


ARMS = {"widowx": WIDOWX_250, "appendix_c": APPENDIX_C}


@pytest.fixture(params=list(ARMS))
def arm(request):
    return ArmKinematics(ARMS[request.param])


def program_and_joints(arm, seed, parameters=ODD):
    """A program, and joints that are away from singularities."""
    rng = np.random.default_rng(seed)
    q = np.zeros(6)
    while np.abs(arm.singularity_determinants(q)).min() < 0.005:
        q[:5] = rng.uniform(arm.lower, arm.upper)[:5]
    objective = PlacementObjective(arm, parameters)
    target = random_target(rng)
    start = rng.uniform(-1, 1, 2)
    return StandProgram(objective, target, OPEN, start, q, None, 0.3), q, rng


def assert_gradient(law, x, rtol=1e-5, atol=1e-6):
    _, gradient = law(x)
    step = 1e-6
    columns = [
        (law(x + step * e)[0] - law(x - step * e)[0]) / (2 * step)
        for e in np.eye(len(x))
    ]
    np.testing.assert_allclose(
        gradient, np.stack(columns, axis=-1), rtol=rtol, atol=atol
    )


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_cost_is_that_of_central_differences(arm, seed):
    program, q, rng = program_and_joints(arm, seed)
    x = np.concatenate([q[:5], rng.uniform(0.01, 1, 30)])
    assert_gradient(program.cost, x, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_reach_error_is_that_of_central_differences(arm, seed):
    program, q, rng = program_and_joints(arm, seed)
    assert_gradient(
        program.reach_error, np.concatenate([rng.uniform(-1, 1, 2), q[:5]])
    )


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_size_excess_is_that_of_central_differences(arm, seed):
    program, q, rng = program_and_joints(arm, seed)
    assert_gradient(
        program.size_excess, np.concatenate([q[:5], rng.uniform(0, 1, 30)])
    )


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_distance_to_the_target_is_that_of_central_differences(
    arm, seed
):
    program, _, rng = program_and_joints(arm, seed)
    assert_gradient(program.distance_to_target, rng.uniform(-2, 2, 2))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(
    "parameters",
    [OBJECTIVE.parameters, ODD, replace(ODD, singularity=0.0)],
    ids=["plain", "odd", "no_singularity"],
)
def test_cost_of_tight_sizes_is_the_objective(arm, parameters, seed):
    rng = np.random.default_rng(seed)
    objective = PlacementObjective(arm, parameters)
    q = rng.uniform(arm.lower, arm.upper)
    q[5] = 0.0
    # As the sixth joint turns about the approach, the target's is the tool's.
    target = ToolTarget(position=[0, 0, 0.5], approach=arm.forward(q)[:3, 0])
    program = StandProgram(objective, target, OPEN, np.zeros(2), q, None, 0.0)
    x = np.concatenate([q[:5], np.zeros(30)])
    # Sizes of 0 fall short of each element by its absolute value.
    short = program.size_excess(x)[0].reshape(2, 30).min(axis=0)
    x[FREE_JOINTS:] = -short
    assert np.all(program.size_excess(x)[0] >= 0)
    assert program.cost(x)[0][0] == pytest.approx(
        float(objective.scores(q).objective), rel=1e-12
    )


def test_reach_error_is_zero_where_the_closed_form_says_so():
    target = TARGET
    scored = score_places(OBJECTIVE, target, lattice(target, 0.1))
    program = None
    for place, q in zip(scored.places, scored.best_q, strict=True):
        if np.isnan(q).any():
            continue
        program = StandProgram(OBJECTIVE, target, OPEN, place, q, None, 0.0)
        error, _ = program.reach_error(np.concatenate([place, q[:5]]))
        np.testing.assert_allclose(error, 0, atol=1e-12)
    assert program is not None


# The best stand


@pytest.mark.parametrize("seed", range(8))
def test_stand_on_open_floor_is_as_good_as_a_dense_search_finds(seed):
    rng = np.random.default_rng(seed)
    target = random_target(rng)
    best = dense(OBJECTIVE, target, OPEN)
    stand, reason = stand_near(target, OPEN)
    if math.isinf(best):
        assert stand is None
        assert reason.startswith("not reachable")
        return
    assert stand.scores.objective <= 1.01 * best
    assert_reaches(stand, target)


def test_most_of_those_targets_are_reachable():
    found = [
        dense(OBJECTIVE, random_target(np.random.default_rng(seed)), OPEN)
        for seed in range(8)
    ]
    assert np.sum(np.isfinite(found)) >= 5


@pytest.mark.parametrize(
    "parameters",
    [
        replace(OBJECTIVE.parameters, torque_weight=0.0, position_weight=0.0),
        replace(OBJECTIVE.parameters, position_weight=0.0, attitude_weight=0.0),
        ODD,
        replace(ODD, singularity=0.0),
    ],
    ids=["attitude", "torque", "odd", "no_singularity"],
)
def test_stand_is_as_good_as_a_dense_search_whatever_counts(parameters):
    objective = PlacementObjective(ARM, parameters)
    target = ToolTarget(position=[0.3, -0.4, 0.45], approach=[0.6, 0, -0.8])
    stand, _ = stand_near(target, OPEN, objective)
    assert stand.scores.objective <= 1.01 * dense(objective, target, OPEN)
    assert_reaches(stand, target)


def test_appendix_c_arm_has_its_best_stand_as_well():
    arm = ArmKinematics(APPENDIX_C)
    objective = PlacementObjective(arm, ObjectiveParameters())
    # Its tool lies across the arm's plane wherever the wrist's roll is 0.
    target = ToolTarget(position=[0.3, -0.4, 0.45], approach=[0.6, 0.8, 0])
    stand, _ = stand_near(target, OPEN, objective)
    best = dense(objective, target, OPEN)
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
    squares = score_places(OBJECTIVE, target, grid.centres)
    stand, reason = find_best_stand(OBJECTIVE, target, free, squares)
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
    # A square of the map that is nowhere near free space is the caller's word.
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    squares = score_places(OBJECTIVE, target, lattice(target, 0.2))
    better = replace(squares, objective=0.01 * squares.objective)
    stand, _ = find_best_stand(OBJECTIVE, target, OPEN, better)
    index = np.nanargmin(better.best)
    np.testing.assert_array_equal(stand.pose[:2], better.places[index])


def test_scores_are_those_of_the_stands_joints():
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    stand, reason = stand_near(target, OPEN)
    turned = stand.q + stand.pose[2] * np.eye(6)[0]
    expected = OBJECTIVE.scores(turned)
    assert stand.scores.objective == pytest.approx(float(expected.objective))
    assert f"objective {float(expected.objective):.3f}" in reason


def test_same_input_gives_the_same_stand_twice():
    target = TARGET
    one, other = (stand_near(target, OPEN) for _ in range(2))
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
    stand, _ = stand_near(target, strip)
    assert strip.contains(stand.pose[:2])
    assert_reaches(stand, target)


# What holds it


def test_stand_held_by_nothing_says_so():
    stand, reason = stand_near(TARGET, OPEN)
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
    at_will, _ = stand_near(target, OPEN)
    assert not free.contains(at_will.pose[:2])
    stand, reason = stand_near(target, free)
    assert stand.active == ("table, 0.27 m away",)
    assert reason.endswith("held by table, 0.27 m away")
    assert stand.scores.objective > at_will.scores.objective
    assert stand.scores.objective <= 1.01 * dense(OBJECTIVE, target, free)


@pytest.mark.parametrize("joint", [2, 3, 5])
def test_joint_whose_limit_is_in_the_way_is_named(joint):
    names = {2: "shoulder", 3: "elbow", 5: "wrist angle"}
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    q = stand_near(target, OPEN)[0].q[joint - 1]
    # A range that ends short of where the joint would be, on either side.
    objective = limited(**{f"joint_{joint}": (-abs(q) + 0.1, abs(q) - 0.1)})
    stand, reason = stand_near(target, OPEN, objective)
    assert any(names[joint] in line for line in stand.active), reason
    assert names[joint] in reason
    assert_reaches(stand, target, objective.arm)
    assert stand.scores.objective <= 1.01 * dense(objective, target, OPEN)


def test_robot_stands_beside_a_target_as_low_as_itself_and_says_so():
    # Without surroundings its chassis may be right where the target is.
    target = ToolTarget(position=[0, 0, 0.3], approach=[0, 0, -1])
    by_it, reason = stand_near(target, OPEN)
    assert np.hypot(*by_it.pose[:2]) < RADIUS
    assert "the target, which" not in reason
    nothing = Surroundings([])
    squares = no_squares(OBJECTIVE, target)
    stand, reason = find_best_stand(
        OBJECTIVE, target, OPEN, squares, surroundings=nothing
    )
    assert np.hypot(*stand.pose[:2]) >= RADIUS + LINK_RADIUS
    assert "the target, which is as low as the robot" in reason
    assert_reaches(stand, target)


def test_stand_whose_arm_touches_nothing_is_as_good_as_a_dense_search_finds():
    target = ToolTarget(position=[0, 0, 0.5], approach=[1, 0, 0])
    # Where the arm would be.
    corners = box_corners(np.array([0.05, 2.0, 0.05]))
    beam = Obstacle("beam", np.array([-0.1, 0.0, 0.6]) + corners)
    surroundings = Surroundings([beam])
    scored = score_places(
        OBJECTIVE, target, lattice(target), surroundings=surroundings
    )
    best = scored.best[~np.isnan(scored.best)].min()
    assert best > 1.05 * dense(OBJECTIVE, target, OPEN)
    squares = no_squares(OBJECTIVE, target)
    stand, _ = find_best_stand(
        OBJECTIVE, target, OPEN, squares, surroundings=surroundings
    )
    assert stand.scores.objective <= 1.01 * best
    assert_reaches(stand, target)


# Headings


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
def test_heading_that_is_given_is_kept(heading):
    target = TARGET
    stand, _ = stand_near(target, OPEN, heading=heading)
    assert wrap_angle(stand.pose[2] - heading) == pytest.approx(0, abs=1e-9)
    assert_reaches(stand, target)


def test_robot_that_may_turn_faces_its_target():
    target = TARGET
    stand, _ = stand_near(target, OPEN)
    x, y = target.p_WT[:2] - stand.pose[:2]
    assert stand.pose[2] == pytest.approx(math.atan2(y, x), abs=1e-9)


def test_robot_that_may_turn_makes_up_for_a_narrow_waist():
    objective = limited(joint_1=(2.0, 2.4))
    at_will, _ = stand_near(TARGET, OPEN)
    stand, _ = stand_near(TARGET, OPEN, objective)
    assert 2.0 <= stand.q[0] <= 2.4
    assert stand.active == ()
    assert_reaches(stand, TARGET, objective.arm)
    assert stand.scores.objective == pytest.approx(
        float(at_will.scores.objective), rel=1e-6
    )


def test_waist_that_a_given_heading_holds_at_its_limit_is_named():
    objective = limited(joint_1=(-0.3, 0.3))
    target = ToolTarget(position=[0, 0, 0.4], approach=[0.6, 0, -0.8])
    stand, reason = stand_near(target, OPEN, objective, heading=2.0)
    best = dense(objective, target, OPEN, heading=2.0)
    assert stand.scores.objective <= 1.01 * best
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
    assert math.isinf(dense(OBJECTIVE, target, free))
    stand, reason = stand_near(target, free)
    assert stand is None
    assert reason.startswith("not reachable: the target at (")
    with pytest.raises(AssertionError, match=why):
        raise AssertionError(reason)
