"""The rules of obstacle avoidance, in scenes made of a few boxes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from drake_mobarm.driving.gaps import (
    free_length,
    unit,
)
from drake_mobarm.driving.waypoint import ControllerParameters, drive_to
from drake_mobarm.geometry import Array
from drake_mobarm.homing.avoidance import (
    AvoidanceParameters,
    AvoidanceState,
    Follow,
    initial_state,
    update,
)
from drake_mobarm.sensors.lidar import cast_rays
from drake_mobarm.world.obstacles import clearance, outlines_to_segments
from helpers.refusals import assert_refused
from helpers.shapes import rectangle

PARAMETERS = AvoidanceParameters()
RANGE_MAX = 12.0
FREE = np.full(360, RANGE_MAX)
STILL = (0.0, 0.0)
PERIOD = 0.1


def scan(boxes: list[Array], pose: ArrayLike) -> Array:
    starts, ends = outlines_to_segments(boxes)
    return np.minimum(cast_rays(starts, ends, pose, 360), RANGE_MAX)


def first_update(
    boxes: list[Array],
    target: tuple[float, float],
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> AvoidanceState:
    return update(
        initial_state(),
        pose,
        target,
        scan(boxes, pose),
        STILL,
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )


def least_clearance(boxes: list[Array], start: Array, end: Array) -> float:
    way = start + np.linspace(0, 1, 200)[:, None] * (end - start)
    return float(clearance(boxes, way).min())


def drive(
    seen: list[Array],
    target: tuple[float, float],
    unseen: list[Array] | None = None,
    seconds: float = 60.0,
    seed: int = 0,
) -> tuple[Array, list[AvoidanceState]]:
    """A disc of 0.27 m that stands still where it would touch something."""
    rng = np.random.default_rng(seed)
    bodies = seen + (unseen or [])
    pose, velocity = np.zeros(3), np.zeros(2)
    state, measured = initial_state(), np.zeros(2)
    path, states = [pose.copy()], []
    for _ in range(int(10 * seconds)):
        ranges = np.clip(
            scan(seen, pose) + rng.normal(0, 0.01, 360), 0, RANGE_MAX
        )
        state = update(
            state, pose, target, ranges, measured, RANGE_MAX, PERIOD, PARAMETERS
        )
        states.append(state)
        for _ in range(5):
            wanted = (
                (state.speed_limit, 0.0)
                if state.speed_limit < 0
                else drive_to(
                    pose,
                    state.waypoint,
                    (min(state.speed_limit, 1.0), 2.0),
                    ControllerParameters(),
                )
            )
            velocity += np.clip(wanted - velocity, (-0.02, -0.06), (0.02, 0.06))
            pose[2] += 0.02 * velocity[1]
            moved = pose[:2] + 0.02 * velocity[0] * unit(pose[2])
            now, then = clearance(bodies, np.array([pose[:2], moved]))
            blocked = then < 0.27 and then < now
            measured = velocity * (0.0 if blocked else 1.0, 1.0)
            if not blocked:
                pose[:2] = moved
        path.append(pose.copy())
        if np.hypot(*(pose[:2] - target)) < 0.3:
            break
    return np.array(path), states


def test_waypoint_is_the_target_at_full_speed_when_the_way_is_free() -> None:
    state = update(
        initial_state(),
        (1, 2, 0.5),
        (4, 3),
        FREE,
        STILL,
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )
    np.testing.assert_allclose(state.waypoint, (4, 3))
    assert state.speed_limit == math.inf
    assert state.rule == "target"


def test_corridor_counts_and_not_the_middle_ray_alone() -> None:
    # 0.2 m beside the straight way: no ray to the target meets it.
    post = rectangle(2.0, 0.2, 2.1, 0.3)
    state = first_update([post], (4, 0))
    assert state.rule == "gap"
    assert state.waypoint[1] < 0
    assert least_clearance([post], np.zeros(2), state.waypoint) > 0.27


def test_waypoint_leads_through_the_opening_of_a_wall() -> None:
    wall = [rectangle(2, -3, 2.1, 0.6), rectangle(2, 1.8, 2.1, 5)]
    state = first_update(wall, (4, 0))
    way = state.waypoint / state.waypoint[0]
    assert 0.6 + 0.27 < 2.05 * way[1] < 1.8 - 0.27
    assert least_clearance(wall, np.zeros(2), state.waypoint) > 0.27


@pytest.mark.parametrize(("width", "passes"), [(0.5, False), (0.8, True)])
def test_only_a_doorway_wider_than_the_robot_is_passed(
    width: float, passes: bool
) -> None:
    # The other way round, past the wall's end, is much longer.
    wall = [rectangle(2, -8, 2.1, -width / 2), rectangle(2, width / 2, 2.1, 3)]
    path, _ = drive(wall, (4, 0))
    assert np.hypot(*(path[-1, :2] - (4, 0))) < 0.3
    crossing = path[np.argmax(path[:, 0] > 2.05), 1]
    assert (abs(crossing) < width / 2) == passes


def test_a_u_shaped_trap_is_left_without_touching() -> None:
    trap = [
        rectangle(2, -1.5, 2.2, 1.5),
        rectangle(-0.5, 1.3, 2, 1.5),
        rectangle(-0.5, -1.5, 2, -1.3),
    ]
    path, _ = drive(trap, (4, 0.3))
    assert np.hypot(*(path[-1, :2] - (4, 0.3))) < 0.3
    assert len(path) < 300
    assert clearance(trap, path[:, :2]).min() > 0.27


def test_unseen_things_are_backed_off_from_and_gone_round() -> None:
    table = rectangle(1.5, -0.6, 2.5, 0.5)
    path, states = drive([rectangle(9, -9, 9.1, 9)], (4, 0), unseen=[table])
    assert np.hypot(*(path[-1, :2] - (4, 0))) < 0.3
    assert any(s.speed_limit < 0 for s in states)
    touched = states[-1].touched
    assert clearance([table], touched[:3]).max() < 0.05
    assert clearance([table], path[:, :2]).min() > 0.26
    # No two touches at one place: each one closes its way.
    touches = touched[1::3]
    for index, touch in enumerate(touches):
        others = np.delete(touches, index, axis=0)
        assert np.all(np.linalg.norm(others - touch, axis=1) > 0.1)


def test_a_stall_backs_off_and_closes_that_direction() -> None:
    state = initial_state()
    rules = []
    for _ in range(30):
        state = update(
            state, (0, 0, 0), (4, 0), FREE, STILL, RANGE_MAX, PERIOD, PARAMETERS
        )
        rules.append(state.rule)
        if state.touched.size and not state.recovery.backs_off:
            break
    assert rules[:5] == ["target"] * 5
    assert set(rules[5:]) == {"back"}
    state = update(
        state,
        (-0.2, 0, 0),
        (4, 0),
        FREE,
        (0.1, 0),
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )
    free = free_length(
        float(np.arctan2(state.waypoint[1], state.waypoint[0] + 0.2)),
        state.touched + np.array([0.2, 0]),
        PARAMETERS.radius,
    )
    assert free == np.inf
    assert state.speed_limit > 0


def test_backing_off_stops_before_what_is_seen_behind() -> None:
    wall = rectangle(-0.5, -1, -0.33, 1)
    state = initial_state()
    for _ in range(10):
        state = update(
            state,
            (0, 0, 0),
            (4, 0),
            scan([wall], (0, 0, 0)),
            STILL,
            RANGE_MAX,
            PERIOD,
            PARAMETERS,
        )
        assert state.speed_limit >= 0


def test_standing_and_turning_in_place_is_no_stall() -> None:
    state = initial_state()
    for _ in range(50):
        state = update(
            state,
            (0, 0, np.pi / 2),
            (4, 0),
            FREE,
            (0, -1),
            RANGE_MAX,
            PERIOD,
            PARAMETERS,
        )
        assert state.rule == "target"


def test_turning_in_place_that_does_not_turn_is_a_stall() -> None:
    state = initial_state()
    for _ in range(round(PARAMETERS.stall_time / PERIOD) + 2):
        state = update(
            state,
            (0, 0, np.pi / 2),
            (4, 0),
            FREE,
            STILL,
            RANGE_MAX,
            PERIOD,
            PARAMETERS,
        )
    assert state.rule == "back"


def test_some_missing_rays_change_little_and_most_missing_stop() -> None:
    wall = [rectangle(2, -3, 2.1, 0.6), rectangle(2, 1.8, 2.1, 5)]
    ranges = scan(wall, (0, 0, 0))
    whole = first_update(wall, (4, 0))
    ranges[::3] = np.nan
    some = update(
        initial_state(),
        (0, 0, 0),
        (4, 0),
        ranges,
        STILL,
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )
    np.testing.assert_allclose(some.waypoint, whole.waypoint, atol=0.15)
    ranges[:181] = np.nan
    most = update(
        whole, (0, 0, 0), (4, 0), ranges, STILL, RANGE_MAX, PERIOD, PARAMETERS
    )
    assert most.speed_limit == 0.0


@pytest.mark.parametrize("target", [(np.nan, 0.0), (np.inf, 0.0)])
def test_a_target_that_is_not_finite_stops(target: tuple[float, float]) -> None:
    state = update(
        initial_state(),
        (0, 0, 0),
        target,
        FREE,
        STILL,
        RANGE_MAX,
        PERIOD,
        PARAMETERS,
    )
    assert state.speed_limit == 0.0
    assert np.isfinite(state.waypoint).all()


@given(st.floats(0.3, 3.0))
def test_speed_stops_before_the_wall_ahead(distance: float) -> None:
    wall = rectangle(0.27 + distance, -6, 5, 6)
    state = first_update([wall], (9, 0))
    # From the limit, at the robot's 1 m/s^2, and in one update's time.
    assert state.speed_limit**2 / 2 < distance


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.floats(0.8, 4),
            st.floats(-3, 3),
            st.floats(0.1, 1),
            st.floats(0.1, 1),
        ),
        max_size=4,
    ),
    st.floats(-1.5, 1.5),
)
def test_a_mirrored_scene_gives_the_mirrored_waypoint(
    corners: list[tuple[float, float, float, float]], y: float
) -> None:
    ranges = scan(
        [rectangle(a, b, a + c, b + d) for a, b, c, d in corners], (0, 0, 0)
    )
    # Behind stays behind; a target straight behind a box would be a tie.
    mirrored = np.roll(ranges[::-1], 1)
    state, twin = (
        update(
            initial_state(),
            (0, 0, 0),
            (5, side * (y + 0.0137)),
            seen,
            STILL,
            RANGE_MAX,
            PERIOD,
            PARAMETERS,
        )
        for side, seen in ((1, ranges), (-1, mirrored))
    )
    np.testing.assert_allclose(
        twin.waypoint * (1, -1), state.waypoint, atol=1e-3
    )
    assert twin.speed_limit == pytest.approx(state.speed_limit, abs=1e-3)


def test_the_waypoint_does_not_dither_while_the_target_fluctuates() -> None:
    rng = np.random.default_rng(1)
    pillar = rectangle(2, -0.5, 3, 0.5)
    state, sides = initial_state(), set()
    for _ in range(100):
        target = rng.normal((6, 0), 0.5)
        state = update(
            state,
            (0, 0, 0),
            target,
            scan([pillar], (0, 0, 0)),
            (0.2, 0),
            RANGE_MAX,
            PERIOD,
            AvoidanceParameters(patience=100.0),
        )
        sides.add(np.sign(state.waypoint[1]))
    assert len(sides) == 1


def test_state_is_not_changed_by_an_update() -> None:
    before = initial_state()
    update(
        before, (0, 0, 0), (4, 0), FREE, STILL, RANGE_MAX, PERIOD, PARAMETERS
    )
    assert before.visited.size == 0
    assert before.target is None


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("radius", 0.0),
        ("margin", np.nan),
        ("smoothing_time", 0.0),
        ("patience", 0),
        ("tight_margin", 0.5),
    ],
)
def test_a_parameter_out_of_range_is_named(name: str, value: float) -> None:
    assert_refused(name, replace, PARAMETERS, **{name: value})


def test_without_a_gain_the_boundary_is_followed_on_one_side() -> None:
    pillar = rectangle(2, -0.5, 3, 0.4)
    ranges = scan([pillar], (0, 0, 0))
    state, rules, sides = initial_state(), [], set()
    for _ in range(90):
        state = update(
            state,
            (0, 0, 0),
            (6, 0),
            ranges,
            (0.2, 0),
            RANGE_MAX,
            PERIOD,
            PARAMETERS,
        )
        rules.append(state.rule)
        sides.add(state.mode.side if isinstance(state.mode, Follow) else 0)
    first = rules.index("follow")
    patience = round(PARAMETERS.patience / PERIOD)
    assert patience <= first <= patience + 5
    assert set(rules[:first]) == {"gap"}
    assert len(sides - {0}) == 1


@pytest.mark.parametrize(
    ("range_max", "rule"), [(5.0, "target"), (12.0, "gap")]
)
def test_only_a_range_below_the_lidars_longest_is_a_thing(
    range_max: float, rule: str
) -> None:
    # In front 5 m everywhere: nothing there, or a round wall before (7, 0).
    ranges = np.full(360, range_max)
    ranges[90:271] = 5.0
    state = update(
        initial_state(),
        (0, 0, 0),
        (7, 0),
        ranges,
        STILL,
        range_max,
        PERIOD,
        PARAMETERS,
    )
    assert state.rule == rule
