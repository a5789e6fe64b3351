"""Against the places' own forward kinematics, composed here from the URDF."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_mobarm.exceptions import ParameterError
from drake_mobarm.geometry import rotation, wrap_angle
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.objective_map import (
    score_places,
    waist_at,
)
from drake_mobarm.placement.problem import ToolTarget
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT
from helpers.stands import (
    ARM,
    OBJECTIVE,
    PLAIN,
    limited,
    problem_of,
    random_target,
)
from helpers.urdf import set_arm

pytestmark = pytest.mark.filterwarnings("error")

FORWARD = ToolTarget(position=[1.0, 2.0, 0.5], approach=[1.0, 0.0, 0.0])


def score(target, places, objective=OBJECTIVE, heading=None):
    problem = problem_of(target, objective=objective, heading=heading)
    return score_places(problem, places)


def narrow(low, high):
    """The WidowX with a waist of these limits [rad]."""
    return limited(joint_1=(low, high)).arm


def target_far_and_wide(rng):
    return random_target(rng, (-5, -5), (5, 5), (0.1, 0.9))


def places_around(target, count, rng, radius=0.8):
    return target.p_WT[:2] + rng.uniform(-radius, radius, (count, 2))


def about(axis, angle):
    """4x4, by Rodrigues' formula."""
    K = np.cross(np.eye(3), axis)
    X = np.eye(4)
    X[:3, :3] += math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    return X


def shifted(x, y, z):
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def tool_pose(pose, q):
    """X_WT of the robot at a pose, joint by joint as the URDF has them."""
    x, y, yaw = pose
    X = shifted(x, y, 0) @ about([0, 0, 1], yaw) @ shifted(0, 0, 0.2965)
    for (axis, origin), angle in zip(
        (
            ([0, 0, 1], (0, 0, 0.072)),
            ([0, 1, 0], (0, 0, 0.03865)),
            ([0, 1, 0], (0.04975, 0, 0.25)),
            ([1, 0, 0], (0.175, 0, 0)),
            ([0, 1, 0], (0.075, 0, 0)),
            ([1, 0, 0], (0.065, 0, 0)),
        ),
        q,
        strict=True,
    ):
        X = X @ shifted(*origin) @ about(axis, angle)
    return X @ shifted(0.093575, 0, 0)


# Places


def test_height_of_the_arms_base_is_that_of_the_urdf(plant):
    X_WB = plant.GetFrameByName("arm_base").CalcPoseInWorld(
        plant.CreateDefaultContext()
    )
    np.testing.assert_allclose(X_WB.translation(), [0, 0, ARM_BASE_HEIGHT])
    assert X_WB.rotation().IsNearlyIdentity()


def test_forward_kinematics_of_these_tests_is_drakes(plant):
    context = plant.CreateDefaultContext()
    rng = np.random.default_rng(0)
    for q in rng.uniform(ARM.lower, ARM.upper, (5, 6)):
        set_arm(plant, context, q)
        X_WT = plant.GetFrameByName("tool").CalcPoseInWorld(context)
        np.testing.assert_allclose(
            tool_pose([0, 0, 0], q), X_WT.GetAsMatrix4(), atol=1e-12
        )


@pytest.mark.parametrize("seed", range(6))
def test_every_solution_brings_the_tip_to_the_target_along_its_approach(seed):
    rng = np.random.default_rng(seed)
    target = target_far_and_wide(rng)
    scored = score(target, places_around(target, 60, rng))
    solved = np.argwhere(~np.isnan(scored.objective))
    for place, solution in solved:
        X_WT = tool_pose(
            [*scored.places[place], 0.0], scored.q[place, solution]
        )
        np.testing.assert_allclose(X_WT[:3, 3], target.p_WT, atol=1e-9)
        np.testing.assert_allclose(X_WT[:3, 0], target.a_W, atol=1e-9)


def test_many_places_around_a_target_have_solutions():
    rng = np.random.default_rng(0)
    scored = score(FORWARD, places_around(FORWARD, 500, rng))
    assert np.sum(~np.isnan(scored.best)) > 50


def test_joints_found_are_within_limits_but_for_the_waist_that_may_turn():
    rng = np.random.default_rng(1)
    places = places_around(FORWARD, 500, rng)
    for arm in (ARM, narrow(-0.5, 0.2)):
        scored = score(FORWARD, places, PlacementObjective(arm, PLAIN))
        q = scored.q[~np.isnan(scored.objective)]
        assert np.all((q >= arm.lower)[:, 1:] & (q <= arm.upper)[:, 1:])
        assert np.ptp(q[:, 0]) > 5


@given(st.floats(0.0, 2 * math.pi), st.floats(0.86, 30))
def test_places_out_of_reach_are_nan(bearing, distance):
    # 0.255 m and 0.25 m of links, 0.159 m of hand: 0.664 m.
    place = FORWARD.p_WT[:2] + distance * np.array(
        [math.cos(bearing), math.sin(bearing)]
    )
    scored = score(FORWARD, [place])
    assert np.isnan(scored.q).all()
    assert np.isnan(scored.objective).all()
    assert np.isnan(scored.best).all()
    assert np.isnan(scored.best_q).all()


def test_leaving_out_what_is_too_far_loses_no_solution():
    # Poses that the arm does take, the stretched one among them.
    rng = np.random.default_rng(2)
    q = rng.uniform(ARM.lower, ARM.upper, (300, 6))
    q[:, 5] = 0
    q[0] = [0.3, 1.5, math.atan2(-0.25, 0.04975) + 1e-9, 0, 1e-9, 0]
    q[0, 2] = max(q[0, 2], ARM.lower[2])
    for joints in q:
        X = tool_pose([0.0, 0.0, 0.0], joints)
        if X[2, 3] < 0:
            continue
        target = ToolTarget(position=X[:3, 3], approach=X[:3, 0])
        scored = score(target, np.zeros((1, 2)))
        off = np.abs(wrap_angle(scored.q[0] - joints)).max(axis=1)
        assert np.nanmin(off) < 1e-5


def test_best_is_the_least_over_the_solutions():
    rng = np.random.default_rng(3)
    scored = score(FORWARD, places_around(FORWARD, 200, rng))
    for i in range(200):
        values = [j for j in scored.objective[i] if not math.isnan(j)]
        if not values:
            assert math.isnan(scored.best[i])
            assert np.isnan(scored.best_q[i]).all()
            continue
        assert scored.best[i] == min(values)
        np.testing.assert_array_equal(
            scored.best_q[i],
            scored.q[i][list(scored.objective[i]).index(min(values))],
        )


def test_objective_is_that_of_the_solutions_joints():
    rng = np.random.default_rng(4)
    scored = score(FORWARD, places_around(FORWARD, 50, rng))
    for q, j in zip(
        scored.q.reshape(-1, 6), scored.objective.ravel(), strict=True
    ):
        if math.isnan(j):
            assert np.isnan(q).all()
        else:
            assert j == pytest.approx(float(OBJECTIVE.scores(q).objective))


def test_solutions_that_the_motors_cannot_hold_are_left_out():
    rng = np.random.default_rng(6)
    places = places_around(FORWARD, 100, rng)
    light = score(FORWARD, places)
    heavy = replace(PLAIN, payload=2.0)
    kept = score(FORWARD, places, PlacementObjective(ARM, heavy))
    solved = ~np.isnan(light.objective)
    torque = ARM.holding_torque(light.q[solved], 2.0)
    load = np.abs(torque / ARM.torque_limit).max(axis=-1)
    # A little too much, far too much, and not too much.
    counts, _ = np.histogram(load, [0, 1, 1.5, 2, np.inf])
    assert (counts[:2] > 0).all()
    np.testing.assert_array_equal(~np.isnan(kept.objective[solved]), load <= 1)


def test_no_places_have_no_scores():
    scored = score(FORWARD, np.empty((0, 2)))
    assert scored.places.shape == (0, 2)
    assert scored.q.shape == (0, 8, 6)
    assert scored.objective.shape == (0, 8)
    assert scored.best.shape == (0,)
    assert scored.best_q.shape == (0, 6)


@pytest.mark.parametrize("places", [[0.0, 0.0], np.zeros((3, 3)), 1.0, []])
def test_places_of_a_wrong_shape_are_refused(places):
    with pytest.raises(ParameterError, match=r"^places have shape .*\(n, 2\)"):
        score(FORWARD, places)


# What moves with everything else


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(-100, 100), st.floats(-100, 100))
def test_moving_target_and_places_changes_no_value(seed, x, y):
    rng = np.random.default_rng(seed)
    target = target_far_and_wide(rng)
    places = places_around(target, 30, rng)
    shift = np.array([x, y, 0.0])
    moved = ToolTarget(position=target.p_WT + shift, approach=target.a_W)
    np.testing.assert_allclose(
        score(moved, places + shift[:2]).best,
        score(target, places).best,
        rtol=1e-6,
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(-math.pi, math.pi))
def test_turning_target_places_and_axes_changes_no_value(seed, turn):
    rng = np.random.default_rng(seed)
    target = target_far_and_wide(rng)
    places = places_around(target, 30, rng)
    axes = rng.uniform(-1, 1, 3)
    before, after = (
        PlacementObjective(
            ARM,
            replace(
                PLAIN,
                position_axes=[axes[0], axes[1], axes[2] + yaw],
                position_axis_weights=[1.0, 2.0, 0.5],
                attitude_axes=[axes[2], axes[0], axes[1] + yaw],
                attitude_axis_weights=[0.0, 2.0, 1.0],
            ),
        )
        for yaw in (0.0, turn)
    )
    R = np.eye(3)
    R[:2, :2] = rotation(turn)
    turned = ToolTarget(position=R @ target.p_WT, approach=R @ target.a_W)
    np.testing.assert_allclose(
        score(turned, places @ R[:2, :2].T, after).best,
        score(target, places, before).best,
        rtol=1e-6,
    )


# Headings


def test_waist_is_what_the_heading_leaves_of_its_direction():
    waist, beyond = waist_at(ARM, [0.5, -3.0, 3.0], [0.2, 3.0, -3.0])
    turn = 2 * math.pi
    np.testing.assert_allclose(waist, [0.3, turn - 6.0, 6.0 - turn])
    assert not beyond.any()


def test_waist_is_clipped_to_its_limit_and_said_to_be_beyond():
    arm = narrow(-0.5, 1.5)  # Its middle is 0.5.
    waist, beyond = waist_at(arm, [0.0, 1.4, 1.6, -0.6, 3.0], 0.0)
    np.testing.assert_allclose(waist, [0.0, 1.4, 1.5, -0.5, 1.5])
    np.testing.assert_array_equal(beyond, [False, False, True, True, True])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(-7, 7))
def test_heading_takes_just_the_solutions_whose_waist_is_beyond(seed, heading):
    rng = np.random.default_rng(seed)
    arm = narrow(*np.sort(rng.uniform(-3, 3, 2)))
    objective = PlacementObjective(arm, PLAIN)
    target = target_far_and_wide(rng)
    places = places_around(target, 40, rng, 0.6)
    free = score(target, places, objective)
    turned = score(target, places, objective, heading)
    # Whether some turn of the waist is within its limits.
    turns = 2 * math.pi * np.arange(-3, 4)
    waist = free.q[..., :1] - heading + turns
    valid = ((waist >= arm.lower[0]) & (waist <= arm.upper[0])).any(axis=-1)
    np.testing.assert_array_equal(
        turned.q, np.where(valid[..., None], free.q, np.nan)
    )
    np.testing.assert_allclose(
        turned.objective, np.where(valid, free.objective, np.nan), rtol=1e-12
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(-7, 7))
def test_robot_at_a_heading_reaches_the_target_with_its_waist_there(
    seed, heading
):
    rng = np.random.default_rng(seed)
    arm = narrow(-1.0, 0.4)
    target = target_far_and_wide(rng)
    places = places_around(target, 20, rng, 0.6)
    objective = PlacementObjective(arm, PLAIN)
    scored = score(target, places, objective, heading)
    for place, q in zip(scored.places, scored.best_q, strict=True):
        if np.isnan(q).any():
            continue
        waist, beyond = waist_at(arm, q[0], heading)
        assert -1.0 <= waist <= 0.4
        assert not beyond
        X_WT = tool_pose([*place, heading], [waist, *q[1:]])
        np.testing.assert_allclose(X_WT[:3, 3], target.p_WT, atol=1e-9)
        np.testing.assert_allclose(X_WT[:3, 0], target.a_W, atol=1e-9)


def test_wide_waist_reaches_as_much_at_any_heading():
    rng = np.random.default_rng(5)
    places = places_around(FORWARD, 200, rng)
    free = score(FORWARD, places)
    for heading in (-2.0, 0.0, 1.0, 9.0):
        np.testing.assert_array_equal(
            score(FORWARD, places, heading=heading).objective,
            free.objective,
        )
