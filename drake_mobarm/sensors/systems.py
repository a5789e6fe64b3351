"""The station's sensors, and the ground truth for metrics, as LeafSystems.

A sensor samples at its own rate and holds what it read. It draws no random
numbers: its noise comes in through a port.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.plant import ContactResults
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
)

from drake_mobarm.geometry import Array, transform_points
from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.sensors.beacon import (
    NOISE_CONFIGURATIONS,
    BeaconParameters,
    in_field_of_view,
    read_beacon,
)
from drake_mobarm.sensors.lidar import LidarParameters, cast_rays, read_lidar
from drake_mobarm.sensors.odometry import integrate_wheels
from drake_mobarm.sensors.rssi import BEACONS
from drake_mobarm.signals import (
    BaseVelocity,
    BeaconReading,
    GroundTruth,
    PlanarPose,
    WheelState,
    size,
)

_CONTACT_PAUSE = 0.5


class Lidar(LeafSystem):
    """Scans the world's cut at the sensor's height.

    .. pydrake_system::

        name: Lidar
        input_ports:
        - base_pose
        - noise
        output_ports:
        - lidar_ranges

    - base_pose (3): PlanarPose, true.
    - noise (rays): standard normal.
    - lidar_ranges (rays): [m], counter-clockwise from straight behind
      (`ray_angles`), about the base's centre; range_max where nothing is.

    No direct feedthrough.
    """

    def __init__(
        self, parameters: LidarParameters, starts: Array, ends: Array
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._starts, self._ends = starts, ends
        self._pose = self.DeclareVectorInputPort("base_pose", size(PlanarPose))
        self._noise = self.DeclareVectorInputPort("noise", parameters.rays)
        state = self.DeclareDiscreteState(
            np.full(parameters.rays, parameters.range_max)
        )
        self.DeclareStateOutputPort("lidar_ranges", state)
        self.DeclarePeriodicDiscreteUpdateEvent(
            1 / parameters.rate, 0.0, self._update
        )

    def _update(self, context: Context, state: DiscreteValues) -> None:
        distance = cast_rays(
            self._starts,
            self._ends,
            self._pose.Eval(context),
            self._parameters.rays,
        )
        state.set_value(
            read_lidar(
                distance,
                self._noise.Eval(context),
                self._parameters.range_max,
                self._parameters.noise,
            )
        )


class BeaconSensor(LeafSystem):
    """Hears the beacon: its angle of arrival and its strength.

    .. pydrake_system::

        name: BeaconSensor
        input_ports:
        - base_pose
        - noise
        output_ports:
        - beacon_reading

    - base_pose (3): PlanarPose, true.
    - noise (3): uniform in [0, 1), for angle, distance and dropout.
    - beacon_reading (3): BeaconReading, angle in the antenna's frame.

    No direct feedthrough.
    """

    def __init__(
        self, parameters: BeaconParameters, noise: int, p_BA: Array, p_WT: Array
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._p_BA, self._p_WT = p_BA, p_WT
        self._configuration = NOISE_CONFIGURATIONS[noise]
        self._pose = self.DeclareVectorInputPort("base_pose", size(PlanarPose))
        self._noise = self.DeclareVectorInputPort("noise", 3)
        state = self.DeclareDiscreteState([np.nan, np.nan, 0.0])
        self.DeclareStateOutputPort("beacon_reading", state)
        self.DeclarePeriodicDiscreteUpdateEvent(
            1 / parameters.rate, 0.0, self._update
        )

    def _update(self, context: Context, state: DiscreteValues) -> None:
        pose = self._pose.Eval(context)
        noise = self._noise.Eval(context)
        p_WA = transform_points(pose, self._p_BA)
        pose_WA = np.array([*p_WA, pose[2]])
        reading = BeaconReading(np.array([np.nan, np.nan, 0.0]))
        if self._hears(context.get_time(), pose_WA, noise[2]):
            reading.angle, reading.rssi = read_beacon(
                pose_WA,
                self._p_WT,
                self._configuration,
                noise[:2],
                BEACONS[self._parameters.model],
            )
            reading.valid = 1.0
        state.set_value(reading[:])

    def _hears(self, time: float, pose_WA: Array, chance: float) -> bool:
        silent = any(
            start <= time < end for start, end in self._parameters.outages
        )
        x, y = self._p_WT - pose_WA[:2]
        return (
            not silent
            and chance >= self._parameters.dropout
            and in_field_of_view(
                np.arctan2(y, x) - pose_WA[2],
                self._parameters.field_of_view / 2,
            )
        )


class Odometry(LeafSystem):
    """Adds up what the wheels' encoders turned.

    .. pydrake_system::

        name: Odometry
        input_ports:
        - measured_wheel_state
        output_ports:
        - measured_base_pose
        - measured_base_velocity

    - measured_wheel_state (4): WheelState [rad, rad/s].
    - measured_base_pose (3): PlanarPose in W, from the start pose on.
    - measured_base_velocity (2): BaseVelocity [m/s, rad/s].

    No direct feedthrough.
    """

    def __init__(
        self, base: DifferentialDrive, start: list[float], rate: float
    ) -> None:
        super().__init__()
        self._base = base
        self._wheels = self.DeclareVectorInputPort(
            "measured_wheel_state", size(WheelState)
        )
        self._pose = self.DeclareDiscreteState(start)
        self._velocity = self.DeclareDiscreteState(size(BaseVelocity))
        self._last_angles = self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("measured_base_pose", self._pose)
        self.DeclareStateOutputPort("measured_base_velocity", self._velocity)
        self.DeclarePeriodicDiscreteUpdateEvent(1 / rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        wheels = self._wheels.Eval(context)
        angles, speeds = wheels[:2], wheels[2:]
        turned = angles - context.get_discrete_state(self._last_angles).value()
        state.set_value(
            self._pose,
            integrate_wheels(
                context.get_discrete_state(self._pose).value(),
                turned,
                self._base,
            ),
        )
        state.set_value(self._velocity, self._base.body_velocity(speeds))
        state.set_value(self._last_angles, angles)


class BaseTruth(LeafSystem):
    """Reads the base's true planar motion off the plant's state.

    .. pydrake_system::

        name: BaseTruth
        input_ports:
        - robot_state
        output_ports:
        - base_pose
        - base_velocity

    - robot_state (n): positions and velocities of the robot's model, its
      floating base first (quaternion, position).
    - base_pose (3): PlanarPose in W.
    - base_velocity (2): BaseVelocity in B.

    Direct feedthrough.
    """

    def __init__(self, num_positions: int, num_states: int) -> None:
        super().__init__()
        self._num_positions = num_positions
        self._state = self.DeclareVectorInputPort("robot_state", num_states)
        self.DeclareVectorOutputPort(
            "base_pose", size(PlanarPose), self._calc_pose
        )
        self.DeclareVectorOutputPort(
            "base_velocity", size(BaseVelocity), self._calc_velocity
        )

    def _read_pose(self, context: Context) -> tuple[Array, Array]:
        state = self._state.Eval(context)
        w, x, y, z = state[:4]
        # Drake lets the quaternion's length wander: no formula for unit ones.
        yaw = math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
        return np.array([state[4], state[5], yaw]), state

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._read_pose(context)[0])

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        (_, _, yaw), state = self._read_pose(context)
        w_WB = state[self._num_positions : self._num_positions + 3]
        v_WB = state[self._num_positions + 3 : self._num_positions + 6]
        forward = v_WB[0] * np.cos(yaw) + v_WB[1] * np.sin(yaw)
        output.SetFromVector([forward, w_WB[2]])


class GroundTruthMonitor(LeafSystem):
    """What metrics may know: true motion, and contacts with obstacles.

    A contact is a touch after at least half a second without one; wheels and
    casters on the ground do not count.

    .. pydrake_system::

        name: GroundTruthMonitor
        input_ports:
        - base_pose
        - base_velocity
        - contact_results
        output_ports:
        - ground_truth

    - base_pose (3): PlanarPose, true.
    - base_velocity (2): BaseVelocity, true.
    - contact_results: the plant's.
    - ground_truth (7): GroundTruth.

    Direct feedthrough.
    """

    def __init__(
        self, is_obstacle_contact: Callable[[Any], bool], rate: float
    ) -> None:
        super().__init__()
        self._is_obstacle_contact = is_obstacle_contact
        self._pose = self.DeclareVectorInputPort("base_pose", size(PlanarPose))
        self._velocity = self.DeclareVectorInputPort(
            "base_velocity", size(BaseVelocity)
        )
        self._results = self.DeclareAbstractInputPort(
            "contact_results", AbstractValue.Make(ContactResults())
        )
        # touching, contacts, time of the last touch
        self._touch = self.DeclareDiscreteState([0.0, 0.0, -np.inf])
        self.DeclareVectorOutputPort(
            "ground_truth", size(GroundTruth), self._calc_truth
        )
        self.DeclarePeriodicDiscreteUpdateEvent(1 / rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        _, contacts, last_touch = context.get_discrete_state(
            self._touch
        ).value()
        results = self._results.Eval(context)
        touching = any(
            self._is_obstacle_contact(results.point_pair_contact_info(i))
            for i in range(results.num_point_pair_contacts())
        )
        time = context.get_time()
        if touching:
            contacts += time - last_touch > _CONTACT_PAUSE
            last_touch = time
        state.set_value(self._touch, [touching, contacts, last_touch])

    def _calc_truth(self, context: Context, output: BasicVector) -> None:
        touch = context.get_discrete_state(self._touch).value()
        output.SetFromVector(
            np.concatenate(
                [
                    self._pose.Eval(context),
                    self._velocity.Eval(context),
                    touch[:2],
                ]
            )
        )
