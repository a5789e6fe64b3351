"""Collisions of the arm, against boxes, lines and the model."""

import numpy as np
import pytest

from drake_mobarm.placement.collision import TIP_LENGTH, Surroundings
from drake_mobarm.placement.objective_map import score_places
from drake_mobarm.placement.problem import ToolTarget
from drake_mobarm.robot.shape import (
    ARM_BASE_HEIGHT,
    CHASSIS_TOP,
    GRIPPER,
    LINK_RADIUS,
    RADIUS,
    WAIST_COLUMN,
)
from drake_mobarm.world.obstacles import (
    Obstacle,
    cylinder_corners,
)
from helpers.shapes import box
from helpers.stands import ARM, problem_of

# Stretched level along x: the arm is a line at the shoulder's height.
STRETCHED = np.deg2rad([0, 78.7449, -78.7449, 0, 0, 0])
SHOULDER = ARM_BASE_HEIGHT + 0.11065
BASE = np.array([0.0, 0.0, ARM_BASE_HEIGHT])


def touched(obstacles, q=STRETCHED, base=BASE):
    return bool(Surroundings(obstacles).touched(ARM, [base], [q])[0])


def test_in_the_open_a_stretched_arm_touches_nothing():
    assert not touched([])


@pytest.mark.parametrize(
    ("distance", "hit"),
    [(LINK_RADIUS - 0.002, True), (LINK_RADIUS + 0.002, False)],
)
@pytest.mark.parametrize("side", ["above", "below", "left", "right"])
def test_an_obstacle_beside_a_link_is_touched_within_the_links_radius(
    side, distance, hit
):
    low, high = (
        np.array([0.3, -0.02, SHOULDER]),
        np.array([0.4, 0.02, SHOULDER]),
    )
    axis = 2 if side in ("above", "below") else 1
    low[2], high[2] = SHOULDER - 0.02, SHOULDER + 0.02
    middle = SHOULDER if axis == 2 else 0.0
    if side in ("above", "left"):
        low[axis], high[axis] = middle + distance, middle + distance + 0.1
    else:
        low[axis], high[axis] = middle - distance - 0.1, middle - distance
    assert touched([box(low, high)]) == hit


def test_a_sharp_edge_is_not_felt_farther_off_than_its_height_tells():
    # A blade under the arm, its edge 0.1 m below the links' middle. Its faces
    # moved out by the links' radius would only meet 0.8 m above the edge.
    edge, foot = SHOULDER - 0.1, SHOULDER - 0.3
    blade = [
        (x, y, z)
        for y in (-0.05, 0.05)
        for x, z in [(0.35, edge), (0.34, foot), (0.36, foot)]
    ]
    lowered = BASE - [0, 0, 0.1 - LINK_RADIUS + 0.005]
    surroundings = Surroundings([Obstacle("blade", np.array(blade))])
    both = surroundings.touched(ARM, [BASE, lowered], [STRETCHED] * 2)
    np.testing.assert_array_equal(both, [False, True])


def test_a_thin_post_does_not_slip_between_the_balls():
    for x in np.linspace(0.1, ARM.reach - TIP_LENGTH - 0.01, 60):
        post = Obstacle(
            "post", cylinder_corners(0.005, 1.0) + np.array([x, 0.0, 0.5])
        )
        assert touched([post])


def test_the_tip_may_touch_its_work_and_the_rest_may_not():
    tip = ARM.reach
    end = tip - TIP_LENGTH
    work = [[end + LINK_RADIUS, -0.1, 0.2], [tip + 0.1, 0.1, 0.6]]
    assert not touched([box(*work)])
    work[0][0] = end - 0.03
    assert touched([box(*work)])


def test_what_touches_in_one_place_is_clear_from_another():
    wall = box([0.4, -1, 0], [0.5, 1, 1])
    assert touched([wall])
    assert not touched([wall], base=BASE - [0.4, 0, 0])
    assert not touched([wall], np.r_[np.pi / 2, STRETCHED[1:]])


def test_forearm_and_hand_keep_off_the_robots_own_chassis():
    # Elbow up, hand straight down, tip at `height`, `reach` from the waist.
    def hand_down(reach, height):
        solutions = ARM.inverse_axis(
            [reach, 0.0, height - ARM_BASE_HEIGHT], [0.0, 0.0, -1.0]
        )
        solutions = solutions[~np.isnan(solutions[:, 0])]
        assert len(solutions)
        surroundings = Surroundings([])
        bases = np.tile(BASE, (len(solutions), 1))
        return surroundings.touched(ARM, bases, solutions)

    above, inside = CHASSIS_TOP + LINK_RADIUS, CHASSIS_TOP - 0.1
    assert not hand_down(RADIUS - 0.05, above + 0.01).all()
    assert hand_down(RADIUS - 0.05, inside).all()
    assert not hand_down(RADIUS + LINK_RADIUS + 0.01, inside).all()


def test_random_arms_and_boxes_agree_with_the_distance_of_their_lines():
    rng = np.random.default_rng(0)
    hits = clear = 0
    for _ in range(1500):
        q = rng.uniform(ARM.lower, ARM.upper)
        corners = ARM.joint_positions(q) + BASE
        beside = corners[rng.integers(1, 5)] + rng.normal(scale=0.15, size=3)
        size = rng.uniform(0.02, 0.2, 3)
        low, high = beside - size / 2, beside + size / 2
        free_hand = (ARM.hand - TIP_LENGTH) / ARM.hand
        end = corners[3] + free_hand * (corners[4] - corners[3])
        # The shoulder itself stands on the waist's column, and has no ball.
        corners[1] += 0.12 * (corners[2] - corners[1])
        line = np.concatenate(
            [
                np.linspace(a, b, 60)
                for a, b in (corners[1:3], corners[2:4], (corners[3], end))
            ]
        )
        if touched([], q):
            continue  # The robot itself is in the way.
        X_AT = ARM.forward(q)
        gripper = corners[3] + 0.0955 * X_AT[:3, 0]
        side = GRIPPER[1] * X_AT[:3, 1]
        line = np.vstack([line, gripper + side, gripper - side])
        outside = np.maximum(np.maximum(low - line, line - high), 0)
        distance = np.linalg.norm(outside, axis=1).min()
        hit = touched([box(low, high)], q)
        # Balls every 4 cm; corners are grown sharp.
        if distance < LINK_RADIUS - 0.012:
            assert hit
            hits += 1
        elif distance > LINK_RADIUS * np.sqrt(3):
            assert not hit
            clear += 1
    assert hits > 20
    assert clear > 100


def test_a_forearm_on_the_chassis_edge_is_touched():
    # Upper arm level, forearm down past the edge, hand level again: only the
    # forearm comes near, from 0.255 m out at 0.41 m height to 0.36 m at 0.18 m.
    q = np.array([0.0, 1.37436, -0.236, 0.0, -1.138, 0.0])
    corners = ARM.joint_positions(q) + BASE
    assert corners[2, 0] == pytest.approx(0.255, abs=0.001)
    assert corners[3, 0] > RADIUS + 2 * LINK_RADIUS
    assert corners[4, 2] == pytest.approx(corners[3, 2], abs=0.001)
    assert touched([], q)
    # With the forearm level it is clear.
    assert not touched([], [0.0, 1.37436, -1.37436, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(("gap", "hit"), [(-0.005, True), (0.005, False)])
def test_a_tip_beside_the_waists_column_touches_it_within_its_radius(gap, hit):
    # The hand level, its tip towards the column, 0.07 m above the chassis and
    # at least 0.09 m off the shoulder, where the upper arm begins.
    tip = [WAIST_COLUMN[0] + LINK_RADIUS + gap, 0.0, 0.07]
    q = ARM.inverse_axis(tip, [-1.0, 0.0, 0.0])
    q = q[~np.isnan(q[:, 0])]
    assert len(q)
    found = Surroundings([]).touched(ARM, np.tile(BASE, (len(q), 1)), q)
    assert found.all() == hit


def test_turning_the_waist_changes_nothing_between_the_arm_and_the_robot():
    rng = np.random.default_rng(1)
    q = rng.uniform(ARM.lower, ARM.upper, (300, 6))
    turned = q + rng.uniform(-3, 3, (300, 1)) * np.eye(6)[0]
    bases = np.tile(BASE, (300, 1))
    before = Surroundings([]).touched(ARM, bases, q)
    assert 50 < before.sum() < 250
    np.testing.assert_array_equal(
        Surroundings([]).touched(ARM, bases, turned), before
    )


def test_a_hand_keeps_off_the_waists_column_and_the_upper_arm():
    for p_AT, a_A in (
        ([0.0, 0.0, 0.1], [1.0, 0.0, 0.0]),  # The tip inside the column.
        ([0.0, 0.0, 0.25], [0.6, 0.0, -0.8]),
    ):
        q = ARM.inverse_axis(p_AT, a_A)
        q = q[~np.isnan(q[:, 0])]
        assert len(q)
        hit = Surroundings([]).touched(ARM, np.tile(BASE, (len(q), 1)), q)
        segments = ARM.joint_positions(q)
        # The upper arm leaves the shoulder: a tip within 5 cm of the line.
        a, b = segments[:, 1], segments[:, 2]
        share = np.sum((p_AT - a) * (b - a), 1) / np.sum((b - a) ** 2, 1)
        line = a + np.clip(share, 0, 1)[:, None] * (b - a)
        near = np.linalg.norm(p_AT - line, axis=1) < 0.05
        assert hit[near].all()
        if p_AT[2] < 0.13:
            assert hit.all()


def test_a_hand_over_the_robot_touches_its_own_upper_arm_within_both_radii():
    rng = np.random.default_rng(2)
    # Folded further than the joints' limits let the WidowX.
    low, high = [-3, -0.9, 1.9, -0.8, 1.6, -3], [3, 0.6, 2.6, 0.8, 3.1, 3]
    q = rng.uniform(low, high, (3000, 6))
    corners = ARM.joint_positions(q)
    X_AT = ARM.forward(q)
    gripper = corners[:, 3] + GRIPPER[0] * X_AT[:, :3, 0]
    side = GRIPPER[1] * X_AT[:, :3, 1]
    share = np.linspace(0, 1, 50)[:, None]

    def line(i):
        a, b = corners[:, i, None], corners[:, i + 1, None]
        return a + share * (b - a)

    hand = np.concatenate(
        [line(3), np.stack([gripper + side, gripper - side], axis=1)], axis=1
    )
    # Neither chassis nor column is near.
    over = np.concatenate([line(2), hand], axis=1)[..., 2].min(axis=1) > 0.18
    pairs = hand[over, :, None] - line(1)[over, None]
    # The first ball of the hand is up to 0.04 m from the wrist's centre.
    apart = np.linalg.norm(pairs, axis=-1).min(axis=2)
    inner = apart[:, share[:, 0].searchsorted(0.04 / ARM.hand) :].min(axis=1)
    hit = Surroundings([]).touched(ARM, np.tile(BASE, (len(q), 1)), q)[over]
    near, far = inner < 0.08 - 0.02, apart.min(axis=1) > 0.08
    assert min(near.sum(), far.sum()) > 30
    assert hit[near].all()
    assert not hit[far].any()


# The map


def test_a_map_leaves_out_what_touches_and_keeps_the_rest():
    target = ToolTarget(position=[0, 0, 0.5], approach=[0, 0, -1])
    steps = np.arange(-0.6, 0.61, 0.1)
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    plain = score_places(problem_of(target), places)
    # A shelf over one half of the floor.
    shelf = box([0.12, -1, 0.55], [1, 1, 0.7])
    problem = problem_of(target, surroundings=Surroundings([shelf]))
    looked = score_places(problem, places)
    kept = ~np.isnan(looked.objective)
    assert 0 < kept.sum() < (~np.isnan(plain.objective)).sum()
    np.testing.assert_array_equal(looked.objective[kept], plain.objective[kept])
    right = places[:, 0] > 0.35
    assert np.isnan(looked.best[right]).all()
    assert not np.isnan(plain.best[right]).all()
    assert not np.isnan(looked.best[places[:, 0] < -0.2]).all()
    none = score_places(problem, places[:0])
    assert none.best.shape == (0,)
