"""The text's planners in small worlds, with a disc that rolls as told."""

import math

import numpy as np
import pytest

from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.navigation.escape import EscapeParameters
from drake_mobarm.navigation.field_planner import (
    EscapePlanner,
    FieldPlanner,
    HighwayPlanner,
)
from drake_mobarm.navigation.highway import (
    Highway,
    HighwayParameters,
    build_highway,
)
from drake_mobarm.navigation.highway_force import HighwayForceParameters
from drake_mobarm.navigation.potential import PotentialParameters
from drake_mobarm.navigation.steering import SteeringParameters
from drake_mobarm.sensors.lidar import ray_angles
from drake_mobarm.world.occupancy import OccupancyGrid
from helpers.rolling import LIDAR, Rolling, grown, room
from helpers.shapes import rectangle

# Written out: what follows is worked out by hand from them.
POTENTIAL = PotentialParameters(
    attraction_gain=1.0,
    conic_distance=1.0,
    repulsion_gain=0.4,
    influence_distance=0.4,
    clearance=0.05,
)
STEERING = SteeringParameters(linear_gain=0.8, angular_gain=2.5)
APF = FieldPlanner(POTENTIAL, STEERING, LIDAR)
ESCAPE = EscapePlanner(POTENTIAL, STEERING, LIDAR, EscapeParameters())
FREE = np.full(LIDAR.rays, LIDAR.range_max)
HOUSE = room(-3, -4, 6, 4)
# A board across the way, and a U that is open towards the start.
BOARD = rectangle(2.0, -1.0, 2.2, 1.0)
U = [
    rectangle(2.0, -1.5, 2.2, 1.5),
    rectangle(0.0, 1.3, 2.0, 1.5),
    rectangle(0.0, -1.5, 2.0, -1.3),
]


def highway_planner(grid, highway, **pull):
    return HighwayPlanner(
        POTENTIAL,
        STEERING,
        LIDAR,
        highway,
        HighwayForceParameters(**pull),
        grid,
    )


def with_highway(outlines, seed=0):
    """APF-HW, with the floor plan of these outlines."""
    grid = grown(outlines, cell=0.2)
    rng = np.random.default_rng(seed)
    return highway_planner(grid, build_highway(grid, HighwayParameters(), rng))


def no_floor_plan():
    """APF-HW in the open, with a highway of one point at (3, 4)."""
    grid = OccupancyGrid(
        np.array([-10.0, -10.0]), 0.5, np.zeros((41, 41), bool)
    )
    return highway_planner(grid, Highway.from_links([(3.0, 4.0)], []))


PLANNERS = pytest.mark.parametrize(
    "law", [APF, ESCAPE, no_floor_plan()], ids=["apf", "apf_escape", "apf_hw"]
)


# In small worlds


@PLANNERS
@pytest.mark.parametrize("target", [(4.0, 0.0), (2.0, -3.0), (-4.0, 1.0)])
def test_in_the_open_every_field_leads_to_the_target(law, target):
    drive = Rolling(law, [], (0, 0, 0), target)
    assert drive.run(20)
    assert drive.distance < 0.4
    # It turns in place first: its way is straight.
    assert drive.length < math.hypot(*target)


@pytest.mark.parametrize("trap", [[BOARD], U], ids=["board", "U"])
def test_the_field_alone_is_trapped_before_a_wall(trap):
    drive = Rolling(APF, [*HOUSE, *trap], (-1, 0.1, 0), (4, 0))
    assert not drive.run(40)
    assert drive.touches == 0
    # For the last ten seconds it has stood before the wall.
    late = np.array(drive.path)[-100:, :2]
    assert np.ptp(late, axis=0).max() < 0.3
    assert 1.2 < drive.pose[0] < 2.0 - 0.27


def test_the_escape_force_leads_round_the_wall_that_traps_the_field_alone():
    drive = Rolling(ESCAPE, [*HOUSE, BOARD], (-1, 0.1, 0), (4, 0))
    assert drive.run(20)
    assert drive.distance < 0.5
    # Round an end of the board, the robot's radius away.
    assert np.abs(np.array(drive.path)[:, 1]).max() > 1.27


@pytest.mark.parametrize("trap", [[BOARD], U], ids=["board", "U"])
@pytest.mark.parametrize("seed", [0, 2])
def test_the_highway_leads_out_of_what_traps_the_field_alone(trap, seed):
    world = [*HOUSE, *trap]
    drive = Rolling(with_highway(world, seed), world, (-1, 0.1, 0), (4, 0))
    assert drive.run(40)
    assert drive.distance < 0.5


# When it has arrived


def one_update(law, target, ranges=FREE, pose=(0.0, 0.0, 0.0)):
    return law.update(
        law.initial_state(), np.array(pose, float), np.array(target), ranges
    )


@PLANNERS
@pytest.mark.parametrize(("distance", "arrived"), [(0.39, True), (0.41, False)])
def test_it_has_arrived_where_the_attraction_is_below_four_tenths(
    law, distance, arrived
):
    # The gain is 1: the attraction is as large as the distance.
    state = one_update(law, (0.6 * distance, -0.8 * distance))
    assert state.arrived is arrived
    velocity = law.command(state, np.zeros(3))
    assert (velocity == (0.0, 0.0)) is arrived


def things_ahead(distance):
    """A thing 45 degrees to the left, and one to the right."""
    ranges = FREE.copy()
    ranges[[135, 225]] = distance
    return ranges


@pytest.mark.parametrize(
    ("distance", "total", "arrived"),
    [
        # 0.4 * 0.01 m^2 * (1/d - 1/0.4) / d^2 each, d off the robot's rim;
        # of two, sqrt(2) times that points backwards. d = 0.15 and 0.2 m.
        (0.42, 1 - math.sqrt(2) * 0.004 * (1 / 0.15 - 2.5) / 0.15**2, True),
        (0.47, 1 - math.sqrt(2) * 0.004 * (1 / 0.2 - 2.5) / 0.2**2, False),
    ],
)
def test_it_has_arrived_where_the_total_force_is_below_four_tenths(
    distance, total, arrived
):
    state = one_update(APF, (1.0, 0.0), things_ahead(distance))
    np.testing.assert_allclose(state.forces.total, [total, 0], atol=1e-9)
    assert (total < 0.4) is arrived
    assert state.arrived is arrived


@PLANNERS
@pytest.mark.parametrize(("reading", "arrived"), [(1.0, True), (0.35, False)])
def test_it_has_not_arrived_at_a_target_that_it_does_not_see(
    law, reading, arrived
):
    # It is 0.38 m away: near enough, unless something is met before it.
    ranges = FREE.copy()
    ranges[175:186] = reading
    assert one_update(law, (0.38, 0.0), ranges).arrived is arrived


# What it does with what it cannot use


@PLANNERS
@pytest.mark.parametrize(
    ("pose", "target", "missing"),
    [
        ((0, 0, 0), (3, 0), 360),
        ((0, 0, 0), (3, 0), 181),
        ((math.nan, 0, 0), (3, 0), 0),
        ((0, 0, math.inf), (3, 0), 0),
        ((2e6, 0, 0), (3, 0), 0),
        ((0, 0, 0), (math.nan, 0), 0),
        ((0, 0, 0), (3, -math.inf), 0),
    ],
)
def test_the_robot_stands_without_a_usable_pose_target_and_scan(
    law, pose, target, missing
):
    driving = one_update(law, (3.0, 0.0))
    assert law.command(driving, np.zeros(3))[0] > 0.5
    ranges = FREE.copy()
    ranges[:missing] = math.nan
    pose, target = np.array(pose, float), np.array(target, float)
    state = law.update(driving, pose, target, ranges)
    assert law.command(state, pose) == (0.0, 0.0)
    assert not state.arrived
    # And goes on with the next scan that can be used.
    state = law.update(state, np.zeros(3), np.array([3.0, 0.0]), FREE)
    assert law.command(state, np.zeros(3))[0] > 0.5


@PLANNERS
def test_with_half_a_scan_the_robot_drives_on(law):
    ranges = FREE.copy()
    ranges[::2] = math.nan
    state = one_update(law, (3.0, 0.0), ranges)
    # The attraction's size is 1 from 1 m on.
    assert law.command(state, np.zeros(3)) == pytest.approx((0.8, 0.0))


@PLANNERS
@pytest.mark.parametrize("nothing", [LIDAR.range_max, math.inf])
def test_a_scan_that_meets_nothing_does_not_repel(law, nothing):
    state = one_update(law, (3.0, 4.0), np.full(LIDAR.rays, nothing))
    np.testing.assert_allclose(state.forces.total, [0.6, 0.8])
    np.testing.assert_array_equal(state.forces.repulsion, [0, 0])


def test_an_update_changes_no_state():
    drive = Rolling(ESCAPE, [*HOUSE, BOARD], (-1, 0.1, 0), (4, 0))
    for _ in range(5):
        drive.step()
    before = drive.state
    places = before.memory.escape.places.copy()
    drive.step()
    np.testing.assert_array_equal(before.memory.escape.places, places)


# The escape's forces


def test_near_the_target_the_attraction_outweighs_the_repulsion():
    # 0.9 m to the target; what is to the left and to the right pushes back.
    ranges = things_ahead(0.45)
    plain, grown_pull = (
        one_update(law, (0.9, 0.0), ranges).forces for law in (APF, ESCAPE)
    )
    assert plain.repulsion[0] < -0.3
    expected = 0.9 - plain.repulsion[0]
    np.testing.assert_allclose(grown_pull.attraction, [expected, 0], atol=1e-9)


def test_a_caught_robot_is_led_to_the_side_where_the_lidar_sees_farther():
    # A wall right ahead, without sight of the target; 5 m free to the left
    # and 2 m to the right.
    ranges = FREE.copy()
    ahead = np.abs(ray_angles(LIDAR.rays)) < 0.9
    ranges[ahead] = 0.45
    ranges[270], ranges[90] = 5.0, 2.0
    for left_is_freer in (True, False):
        state = ESCAPE.initial_state()
        for _ in range(20):
            state = ESCAPE.update(
                state, np.zeros(3), np.array([3.0, 0.0]), ranges
            )
        across = state.forces.attraction[1]
        # 1.5 times the attraction of 1, nearly along the wall.
        assert abs(across) == pytest.approx(1.5, abs=0.05)
        assert bool(across > 0) is left_is_freer
        ranges[[90, 270]] = ranges[[270, 90]]


def test_what_is_on_the_plan_repels_and_hides_where_it_counts_as_seen():
    # On the plan is a wall at x = 6; the lidar sees nothing.
    occupied = np.zeros((200, 200), dtype=bool)
    occupied[:, 120] = True
    known = KnownFloor(OccupancyGrid(np.zeros(2), 0.05, occupied))
    seeing = FieldPlanner(POTENTIAL, STEERING, LIDAR, known=known)
    pose, behind = (5.8, 7.0, 0.3), (6.15, 7.0)
    plain, seen = (one_update(law, behind, pose=pose) for law in (APF, seeing))
    # It is 0.35 m from the target: there, were there no wall before it.
    assert plain.arrived
    assert not seen.arrived
    np.testing.assert_array_equal(plain.forces.repulsion, [0, 0])
    push = seen.forces.repulsion
    assert push[0] < -1
    assert abs(push[1]) < 0.2 * abs(push[0])


# The highway


def plan_with_wall():
    """Half-metre squares about the origin, and a wall at x = 2, 4 m long."""
    occupied = np.zeros((41, 41), dtype=bool)
    occupied[16:25, 24] = True
    return OccupancyGrid(np.array([-10.0, -10.0]), 0.5, occupied)


# 0 stands beside the start, 1 above the wall's end, 2 behind it, 3 far off.
POINTS = [(0.5, 0.5), (2.0, 4.0), (4.0, 1.0), (-6.0, -6.0)]
LINKED = Highway.from_links(POINTS, [(0, 1), (1, 2), (0, 3)])


def wall_ahead():
    """The scan of that wall from the origin: 2 m ahead, 90 degrees wide."""
    angles = ray_angles(LIDAR.rays)
    ahead = np.abs(angles) <= math.pi / 4 + 1e-9
    ranges = FREE.copy()
    ranges[ahead] = 2 / np.cos(angles[ahead])
    return ranges


def test_without_sight_of_the_target_the_highway_pulls_by_hand():
    law = highway_planner(plan_with_wall(), LINKED, weight=3.0)
    state = one_update(law, (4.0, 0.0), wall_ahead())
    # Only point 2 is within 2 m of the target and sees it. In sight of the
    # robot are 0, 1 and 3; the path from 0 is sqrt(0.5) + |(1.5, 3.5)| +
    # |(2, 3)| long, that from 1 |(2, 4)| + |(2, 3)|: shorter.
    (path,) = state.paths
    np.testing.assert_array_equal(path, [POINTS[1], POINTS[2]])
    length = math.hypot(2, 4) + math.hypot(2, 3)
    # One path, one visible point (1), |F_att| = 1.
    np.testing.assert_allclose(
        state.forces.highway, 3 * 10 / length * np.array([2.0, 4.0])
    )
    np.testing.assert_allclose(state.forces.attraction, [1.0, 0.0])


def test_in_sight_of_the_target_the_highway_is_not_engaged():
    law = highway_planner(plan_with_wall(), LINKED)
    engaged = one_update(law, (4.0, 0.0), wall_ahead())
    assert engaged.paths
    # The wall is on the plan, but the lidar does not see it.
    state = law.update(engaged, np.zeros(3), np.array([4.0, 0.0]), FREE)
    assert state.paths == ()
    np.testing.assert_array_equal(state.forces.highway, [0, 0])


def test_a_target_in_a_square_of_the_plan_that_is_taken_has_exits():
    law = highway_planner(plan_with_wall(), LINKED)
    # On the plan the target is in the wall; the nearest free squares are
    # beside it.
    state = one_update(law, (2.2, 0.0), wall_ahead())
    assert [path[-1].tolist() for path in state.paths] == [[4.0, 1.0]]


def test_a_highway_without_points_pulls_nowhere():
    law = highway_planner(
        plan_with_wall(), Highway.from_links(np.empty((0, 2)), [])
    )
    state = one_update(law, (4.0, 0.0), wall_ahead())
    np.testing.assert_array_equal(state.forces.highway, [0, 0])
    np.testing.assert_allclose(state.forces.total, [1.0, 0.0])


def corridor(width, off):
    """A scan from `off` beside the middle of a corridor along x."""
    sides = np.sin(ray_angles(LIDAR.rays))
    ranges = FREE.copy()
    left, right = sides > 0.05, sides < -0.05
    ranges[left] = (width / 2 - off) / sides[left]
    ranges[right] = (width / 2 + off) / -sides[right]
    return np.minimum(ranges, LIDAR.range_max)


def test_only_with_highway_influence_is_less_between_things_close_together():
    # A metre wide: (1 - 0.54) / 2 - 0.05 = 0.18 m of influence, and 0.21 m
    # and more to the walls. Without (3.2) it is 0.4 m.
    ranges = corridor(1.0, 0.02)
    plain, highway = (
        one_update(law, (3.0, 0.0), ranges).forces.repulsion
        for law in (APF, no_floor_plan())
    )
    assert plain[1] < -0.05
    np.testing.assert_array_equal(highway, [0, 0])
