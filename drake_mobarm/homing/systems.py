"""Homing as LeafSystems: target estimator and obstacle avoidance.

Both run a little after the sensors have sampled, so that
a reading and the odometry seen with it are of the same instant.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_mobarm.geometry import Array, is_pose, transform_points
from drake_mobarm.homing import avoidance, lookout
from drake_mobarm.homing.screening import (
    PoseHistory,
    PoseVerdict,
    is_possible_strength,
    screen_pose,
)
from drake_mobarm.immutable import Immutable
from drake_mobarm.sensors.beacon import BeaconParameters
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.sensors.rssi import RssiModel
from drake_mobarm.signals import (
    BaseVelocity,
    BeaconReading,
    PlanarPose,
    TargetEstimate,
    Waypoint,
    size,
)


class TargetLaw(Protocol):
    """An estimator's law in plain numpy, such as `FilterEstimator`."""

    def initial_state(self) -> Any:
        """The state before the first reading; it is never changed."""

    def update(
        self, state: Any, p_WA: Array, bearing_W: float, distance: float
    ) -> Any:
        """The state after a reading.

        Args:
            state: before the reading; it is not changed.
            p_WA: the antenna's position by odometry [m], (2,).
            bearing_W: heading plus angle of arrival [rad].
            distance: from RSSI [m].

        Returns:
            The state after it: the same one where the reading is not finite
            or its distance is negative.
        """

    def estimate(self, state: Any) -> Array | None:
        """The estimated target p_WT [m], (2,), or None before a reading."""

    def arrived(self, state: Any, p_WB: Array) -> bool:
        """Whether the robot is at the target.

        Args:
            state: of the law.
            p_WB: the base's position by odometry [m], (2,).
        """


@dataclass(frozen=True, eq=False)
class _Memory(Immutable):
    """What it remembers: poses, the law's state, and the last reading."""

    poses: PoseHistory
    law: Any
    reading: tuple[float, float] = (math.nan, math.nan)


class TargetEstimator(LeafSystem):
    """Estimates where the beacon is, from readings taken on the way.

    .. pydrake_system::

        name: TargetEstimator
        input_ports:
        - measured_base_pose
        - beacon_reading
        output_ports:
        - estimated_target
        - arrived

    - measured_base_pose (3): PlanarPose in W.
    - beacon_reading (3): BeaconReading, angle in the antenna's frame.
    - estimated_target (3): TargetEstimate in W.
    - arrived (1): 1 where the law's arrival conditions hold.

    A reading that is marked invalid, is not finite, or has a strength that no
    beacon has, changes nothing; nor does one that is the last one once more,
    as its sensor hangs, nor any while the pose is dropped. Where
    the pose has jumped for good the law begins anew.

    No direct feedthrough.

    Args:
        law: how to estimate: `HybridEstimator`, `FilterEstimator`, or one's
            own.
        calibration: of the beacon's RSSI.
        p_BA: the antenna in the base's frame [m], (2,).
        rate: readings a second [Hz].
        delay: after the sensor's samples [s].
        limits: the robot's highest speed [m/s] and turn rate [rad/s].
    """

    def __init__(
        self,
        law: TargetLaw,
        calibration: RssiModel,
        p_BA: Array,
        rate: float,
        delay: float,
        limits: tuple[float, float] = (1.0, 5.0),
    ) -> None:
        super().__init__()
        self._law = law
        self._calibration = calibration
        self._p_BA = p_BA
        self._period, self._limits = 1 / rate, limits
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._reading = self.DeclareVectorInputPort(
            "beacon_reading", size(BeaconReading)
        )
        self._memory = self.DeclareAbstractState(
            Value(_Memory(PoseHistory(), law.initial_state()))
        )
        self._estimate = self.DeclareDiscreteState([np.nan, np.nan, 0.0])
        self._arrived = self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("estimated_target", self._estimate)
        self.DeclareStateOutputPort("arrived", self._arrived)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / rate, delay, self._update
        )

    def _update(self, context: Context, state: State) -> None:
        pose = tuple(self._pose.Eval(context).tolist())
        angle, rssi, valid = self._reading.Eval(context).tolist()
        last = context.get_abstract_state(int(self._memory)).get_value()
        poses, verdict = screen_pose(
            last.poses, pose, self._period, self._limits
        )
        memory = last.law
        if verdict is PoseVerdict.MOVED:
            memory = self._law.initial_state()
        heard = (
            valid > 0.5
            and (angle, rssi) != last.reading
            and math.isfinite(angle)
            and is_possible_strength(rssi, self._calibration)
        )
        usable = verdict is not PoseVerdict.DROPPED
        if usable and heard:
            memory = self._law.update(
                memory,
                transform_points(pose, self._p_BA),
                pose[2] + angle,
                float(self._calibration.distance(rssi)),
            )
        state.get_mutable_abstract_state(int(self._memory)).set_value(
            _Memory(poses, memory, (angle, rssi))
        )
        target = self._law.estimate(memory)
        arrived = usable and self._law.arrived(memory, np.array(pose[:2]))
        discrete = state.get_mutable_discrete_state()
        known = [np.nan, np.nan, 0.0] if target is None else [*target, 1.0]
        discrete.set_value(self._estimate, known)
        discrete.set_value(self._arrived, [float(arrived)])


class Lookout(LeafSystem):
    """Turns back to a beacon that a narrow field of view leaves unheard.

    .. pydrake_system::

        name: Lookout
        input_ports:
        - measured_base_pose
        - beacon_reading
        - estimated_target
        - lidar_ranges
        - avoidance_waypoint
        output_ports:
        - waypoint

    - measured_base_pose (3): PlanarPose in W.
    - beacon_reading (3): BeaconReading, angle in the antenna's frame.
    - estimated_target (3): TargetEstimate in W.
    - lidar_ranges (rays): [m], as `ray_angles` orders them.
    - avoidance_waypoint (3): Waypoint in W.
    - waypoint (3): Waypoint in W: the avoidance's, but while the robot looks.

    Direct feedthrough.

    With an antenna that hears all around it never looks.

    Args:
        parameters: when to look.
        beacon: how the antenna hears.
        lidar: whose ranges these are.
        delay: after the antenna's samples [s].
    """

    def __init__(
        self,
        parameters: lookout.LookoutParameters,
        beacon: BeaconParameters,
        lidar: LidarParameters,
        delay: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._range_max, self._period = lidar.range_max, 1 / beacon.rate
        self._looks = beacon.field_of_view < 2 * math.pi
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._reading = self.DeclareVectorInputPort(
            "beacon_reading", size(BeaconReading)
        )
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        self._avoidance = self.DeclareVectorInputPort(
            "avoidance_waypoint", size(Waypoint)
        )
        self._memory = self.DeclareAbstractState(Value(lookout.LookoutState()))
        self.DeclareVectorOutputPort("waypoint", size(Waypoint), self._calc)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / beacon.rate, delay, self._update
        )

    def _update(self, context: Context, state: State) -> None:
        if not self._looks:
            return
        pose = self._pose.Eval(context).tolist()
        x, y, known = self._target.Eval(context).tolist()
        if known < 0.5 or not is_pose(pose):
            return
        memory = context.get_abstract_state(int(self._memory)).get_value()
        memory = lookout.update(
            memory,
            pose,
            (x, y),
            self._reading.Eval(context)[2] > 0.5,
            memory.mode == "back" and self._is_free_behind(context, pose),
            self._period,
            self._parameters,
        )
        state.get_mutable_abstract_state(int(self._memory)).set_value(memory)

    def _is_free_behind(self, context: Context, pose: list[float]) -> bool:
        return lookout.is_free_behind(
            pose, self._ranges.Eval(context), self._range_max
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        memory = context.get_abstract_state(int(self._memory)).get_value()
        found = self._avoidance.Eval(context)
        if self._looks:
            x, y, known = self._target.Eval(context).tolist()
            if known < 0.5:
                found = (np.nan, np.nan, 0.0)
            elif memory.mode != "drive":
                pose = self._pose.Eval(context).tolist()
                found = lookout.waypoint(memory, pose, (x, y), self._parameters)
        output.SetFromVector(found)


class StraightToTarget(LeafSystem):
    """No avoidance: the waypoint is the target itself.

    .. pydrake_system::

        name: StraightToTarget
        input_ports:
        - estimated_target
        output_ports:
        - waypoint

    - estimated_target (3): TargetEstimate in W.
    - waypoint (3): Waypoint in W, without a limit of its own on speed.

    Direct feedthrough.
    """

    def __init__(self) -> None:
        super().__init__()
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self.DeclareVectorOutputPort("waypoint", size(Waypoint), self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        target = TargetEstimate(self._target.Eval(context))
        if target.known > 0.5:
            output.SetFromVector([target.x, target.y, np.inf])
        else:
            output.SetFromVector([np.nan, np.nan, 0.0])


class ObstacleAvoidance(LeafSystem):
    """Leads around obstacles to the target, by rules on each lidar scan.

    .. pydrake_system::

        name: ObstacleAvoidance
        input_ports:
        - measured_base_pose
        - measured_base_velocity
        - estimated_target
        - lidar_ranges
        output_ports:
        - waypoint
        - given_up

    - measured_base_pose (3): PlanarPose in W.
    - measured_base_velocity (2): BaseVelocity in B.
    - estimated_target (3): TargetEstimate in W.
    - lidar_ranges (rays): [m], as `ray_angles` orders them.
    - waypoint (3): Waypoint in W.
    - given_up (3): GivenUp, with the robot's place, where it goes round and
      round.

    No direct feedthrough.

    Args:
        parameters: of the rules.
        lidar: whose ranges these are.
        delay: after the lidar's samples [s].
    """

    def __init__(
        self,
        parameters: avoidance.AvoidanceParameters,
        lidar: LidarParameters,
        delay: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._range_max, self._period = lidar.range_max, 1 / lidar.rate
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._velocity = self.DeclareVectorInputPort(
            "measured_base_velocity", size(BaseVelocity)
        )
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        self._memory = self.DeclareAbstractState(
            Value(avoidance.initial_state())
        )
        self._waypoint = self.DeclareDiscreteState([np.nan, np.nan, 0.0])
        self._given_up = self.DeclareDiscreteState(3)
        self.DeclareStateOutputPort("waypoint", self._waypoint)
        self.DeclareStateOutputPort("given_up", self._given_up)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / lidar.rate, delay, self._update
        )

    def _update(self, context: Context, state: State) -> None:
        target = TargetEstimate(self._target.Eval(context))
        pose = self._pose.Eval(context)
        if target.known < 0.5 or not is_pose(pose):
            return
        memory = avoidance.update(
            context.get_abstract_state(int(self._memory)).get_value(),
            pose,
            target[:2],
            self._ranges.Eval(context),
            self._velocity.Eval(context),
            self._range_max,
            self._period,
            self._parameters,
        )
        state.get_mutable_abstract_state(int(self._memory)).set_value(memory)
        discrete = state.get_mutable_discrete_state()
        discrete.set_value(
            self._waypoint, [*memory.waypoint, memory.speed_limit]
        )
        if avoidance.has_given_up(memory, self._parameters):
            discrete.set_value(self._given_up, [1.0, pose[0], pose[1]])
