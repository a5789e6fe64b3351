"""The text's planners: the potential field alone, with escape, with highway.

At each scan the forces at the robot are worked out anew (Figure 3.4): the
target's attraction, the repulsion of what the lidar sees, and, where the
target is not in sight, the highway's pull. (3.9) and (3.10) make a velocity
of their sum.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drake_mobarm.driving.known_floor import KnownFloor
from drake_mobarm.geometry import Array, is_pose
from drake_mobarm.immutable import Immutable
from drake_mobarm.navigation.escape import (
    NO_ESCAPE,
    EscapeParameters,
    EscapeState,
    escape_force,
    grown_attraction,
    update_escape,
)
from drake_mobarm.navigation.highway import Highway
from drake_mobarm.navigation.highway_force import (
    HighwayForceParameters,
    HighwayPath,
    choose_paths,
    exits,
    highway_force,
)
from drake_mobarm.navigation.line_of_sight import LineOfSight
from drake_mobarm.navigation.planner import Forces, PlannerState
from drake_mobarm.navigation.potential import (
    PotentialParameters,
    attraction,
    influence_distances,
    repulsion,
)
from drake_mobarm.navigation.scan_squares import SQUARE, ScanSquares, cluster
from drake_mobarm.navigation.steering import SteeringParameters, steer
from drake_mobarm.robot.shape import RADIUS
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.world.occupancy import OccupancyGrid

# With more than this share of its rays missing, a scan is not to be trusted.
_MISSING_RAYS = 0.5
# Arrived where the total force, or the attraction, is below this [1/m].
_ARRIVED_FORCE = 0.4


@dataclass(frozen=True, eq=False)
class FieldMemory(Immutable):
    """What a field's planner remembers.

    Attributes:
        velocity: commanded since the last scan [m/s, rad/s].
        escape: of its escape.
    """

    velocity: tuple[float, float] = (0.0, 0.0)
    escape: EscapeState = NO_ESCAPE


class FieldPlanner:
    """The potential field, as section 3.3.4 drives by it.

    Args:
        potential: shape of the field.
        steering: from force to velocity.
        lidar: whose ranges it reads.
        known: the floor of the plan, where what is on it is to count as seen:
            table tops and low feet are not in the lidar's plane.
    """

    def __init__(
        self,
        potential: PotentialParameters,
        steering: SteeringParameters,
        lidar: LidarParameters,
        *,
        known: KnownFloor | None = None,
    ) -> None:
        self._potential = potential
        self._known = known
        self._steering = steering
        self._range_max, self._period = lidar.range_max, 1 / lidar.rate

    def initial_state(self) -> PlannerState:
        """Nothing seen, standing still."""
        return PlannerState(memory=FieldMemory())

    def update(
        self, state: PlannerState, pose_WB: Array, p_WT: Array, ranges: Array
    ) -> PlannerState:
        """The forces and the velocity for a scan; see `PlannerLaw`.

        Where pose, target or scan cannot be used, the robot stands still.
        """
        missing = np.count_nonzero(np.isnan(ranges)) / ranges.size
        usable = is_pose(pose_WB) and bool(np.isfinite(p_WT).all())
        if not usable or missing > _MISSING_RAYS:
            return replace(
                state, memory=replace(state.memory, velocity=(0.0, 0.0))
            )
        position, yaw = np.array(pose_WB[:2]), float(pose_WB[2])
        known, size = np.empty((0, 2)), 0.0
        if self._known is not None:
            known = self._known.near(position) - position
            size = self._known.cell
        scan = ScanSquares.from_ranges(
            yaw, ranges, self._range_max, known, size
        )
        way = p_WT - position
        sees_target = bool(scan.sees(way[None])[0])
        pull = attraction(position, p_WT, self._potential)
        forces = Forces(pull, self._repulsion(scan, way), np.zeros(2))
        state = self._forces(
            replace(state, forces=forces, paths=()),
            position,
            p_WT,
            scan,
            sees_target,
        )
        total = state.forces.total
        weak = min(math.hypot(*total), math.hypot(*state.forces.attraction))
        arrived = sees_target and weak < _ARRIVED_FORCE
        velocity = steer(total, yaw, self._steering)
        return replace(
            state,
            arrived=arrived,
            memory=replace(
                state.memory, velocity=(0.0, 0.0) if arrived else velocity
            ),
        )

    def command(
        self, state: PlannerState, pose_WB: Array
    ) -> tuple[float, float]:
        """The velocity that the last scan asked for."""
        velocity: tuple[float, float] = state.memory.velocity
        return velocity

    def _influence(self, squares: Array) -> Array | float:
        return self._potential.influence_distance

    def _repulsion(self, scan: ScanSquares, way: Array) -> Array:
        squares = scan.centres
        distance = np.hypot(squares[:, 0], squares[:, 1])
        near = distance < RADIUS + self._potential.influence_distance
        influence = self._influence(squares)
        return repulsion(
            squares[near],
            influence if isinstance(influence, float) else influence[near],
            SQUARE**2,
            way,
            self._potential,
            radius=RADIUS,
        )

    def _forces(
        self,
        state: PlannerState,
        position: Array,
        target: Array,
        scan: ScanSquares,
        sees_target: bool,
    ) -> PlannerState:
        """The state with all forces of this planner."""
        return state


class EscapePlanner(FieldPlanner):
    """The potential field with an escape force, our stand-in for [39].

    Args:
        potential: shape of the field.
        steering: from force to velocity.
        lidar: whose ranges it reads.
        escape: when and how to escape.
        known: the floor of the plan, where that counts as seen.
    """

    def __init__(
        self,
        potential: PotentialParameters,
        steering: SteeringParameters,
        lidar: LidarParameters,
        escape: EscapeParameters,
        *,
        known: KnownFloor | None = None,
    ) -> None:
        super().__init__(potential, steering, lidar, known=known)
        self._escape = escape

    def _forces(
        self,
        state: PlannerState,
        position: Array,
        target: Array,
        scan: ScanSquares,
        sees_target: bool,
    ) -> PlannerState:
        pull, push, _ = state.forces
        distance = float(np.hypot(*(target - position)))
        sides = np.array([[-push[1], push[0]], [push[1], -push[0]]])
        left, right = scan.readings(sides).tolist()
        memory = replace(
            state.memory,
            escape=update_escape(
                state.memory.escape,
                position,
                pull,
                push,
                distance,
                sees_target,
                (left, right),
                self._period,
                self._escape,
            ),
        )
        along = escape_force(memory.escape, pull, push, self._escape)
        pull = grown_attraction(pull, push, distance, self._escape)
        forces = Forces(pull + along, push, np.zeros(2))
        return replace(state, forces=forces, memory=memory)


class HighwayPlanner(FieldPlanner):
    """The potential field with highway, APF-HW.

    Args:
        potential: shape of the field.
        steering: from force to velocity.
        lidar: whose ranges it reads.
        highway: of the floor plan.
        pull: how strongly it pulls.
        grid: squares of the floor plan, grown by the robot's radius, by which
            the highway was made.
        known: the floor of the plan, where that counts as seen.
    """

    def __init__(
        self,
        potential: PotentialParameters,
        steering: SteeringParameters,
        lidar: LidarParameters,
        highway: Highway,
        pull: HighwayForceParameters,
        grid: OccupancyGrid,
        *,
        known: KnownFloor | None = None,
    ) -> None:
        super().__init__(potential, steering, lidar, known=known)
        self._highway, self._pull = highway, pull
        self._sight = LineOfSight(grid)
        self._free = grid.centres()[~grid.occupied]
        # An estimate of the target moves, and mostly stays in one square.
        self._seeing = lru_cache(maxsize=64)(self._points_that_see)

    def _influence(self, squares: Array) -> Array | float:
        return influence_distances(
            squares, cluster(squares), self._potential, radius=RADIUS
        )

    def _forces(
        self,
        state: PlannerState,
        position: Array,
        target: Array,
        scan: ScanSquares,
        sees_target: bool,
    ) -> PlannerState:
        if sees_target or not len(self._highway.points):
            return state
        points = self._highway.points
        seen = scan.sees(points - position)
        paths = self._paths(position, target, seen)
        pull = self._pull.weight * highway_force(
            points, paths, position, seen, state.forces.attraction
        )
        return replace(
            state,
            forces=state.forces._replace(highway=pull),
            paths=tuple(points[path.points] for path in paths),
        )

    def _paths(
        self, position: Array, target: Array, seen: NDArray[np.bool_]
    ) -> list[HighwayPath]:
        # A target right beside furniture is in a grown square.
        apart = np.hypot(*(self._free - target).T)
        sees_target = self._seeing(int(np.argmin(apart)))
        found = exits(self._highway.points, target, sees_target, self._pull)
        return choose_paths(
            self._highway, position, np.flatnonzero(seen), found
        )

    def _points_that_see(self, square: int) -> NDArray[np.bool_]:
        return self._sight.clear(self._highway.points, self._free[square])
