"""The station's sensors as LeafSystems.

A sensor samples at its own rate and holds what it read. It draws no random
numbers: its noise comes in through a port.
"""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
    State,
)

from drake_mobarm.geometry import Array, transform_points
from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.sensors.beacon import (
    NOISE_CONFIGURATIONS,
    Beacon,
    BeaconParameters,
    in_field_of_view,
    read_beacon,
)
from drake_mobarm.sensors.distance_field import DistanceField
from drake_mobarm.sensors.lidar import LidarParameters, cast_rays, read_lidar
from drake_mobarm.sensors.localization import (
    LocalizationParameters,
    begin,
    localize,
    predict,
)
from drake_mobarm.sensors.odometry import (
    OdometryParameters,
    believed_base,
    count_ticks,
    integrate_wheels,
    scale_wheels,
)
from drake_mobarm.sensors.rssi import BEACONS
from drake_mobarm.sensors.scan_matching import (
    ScanMatchingParameters,
    ScanMatchingState,
    compose,
    match,
)
from drake_mobarm.signals import (
    BaseVelocity,
    PlanarPose,
    WheelState,
    size,
)


class Lidar(LeafSystem):
    """Scans the world's cut at the sensor's height.

    .. pydrake_system::

        name: Lidar
        input_ports:
        - base_pose
        - lidar_noise
        output_ports:
        - lidar_ranges

    - base_pose (3): PlanarPose, true.
    - lidar_noise (rays): standard normal.
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
        self._noise = self.DeclareVectorInputPort(
            "lidar_noise", parameters.rays
        )
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
        - beacon_noise
        output_ports:
        - beacon_reading

    - base_pose (3): PlanarPose, true.
    - beacon_noise (3): uniform in [0, 1), for angle, distance and dropout.
    - beacon_reading (3): BeaconReading, angle in the antenna's frame.

    No direct feedthrough.
    """

    def __init__(
        self, parameters: BeaconParameters, beacon: Beacon, p_BA: Array
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._p_BA, self._p_WT = p_BA, beacon.position
        self._configuration = NOISE_CONFIGURATIONS[beacon.noise]
        self._pose = self.DeclareVectorInputPort("base_pose", size(PlanarPose))
        self._noise = self.DeclareVectorInputPort("beacon_noise", 3)
        state = self.DeclareDiscreteState([np.nan, np.nan, 0.0])
        self.DeclareStateOutputPort("beacon_reading", state)
        self.DeclarePeriodicDiscreteUpdateEvent(
            1 / parameters.rate, 0.0, self._update
        )

    def _update(self, context: Context, state: DiscreteValues) -> None:
        pose = self._pose.Eval(context).tolist()
        u_angle, u_distance, chance = self._noise.Eval(context).tolist()
        x, y = transform_points(pose, self._p_BA).tolist()
        pose_WA = (x, y, pose[2])
        if not self._hears(context.get_time(), pose_WA, chance):
            state.set_value([np.nan, np.nan, 0.0])
            return
        angle, rssi = read_beacon(
            pose_WA,
            self._p_WT,
            self._configuration,
            (u_angle, u_distance),
            BEACONS[self._parameters.model],
        )
        state.set_value([angle, rssi, 1.0])

    def _hears(
        self, time: float, pose_WA: tuple[float, float, float], chance: float
    ) -> bool:
        silent = any(
            start <= time < end for start, end in self._parameters.outages
        )
        x, y, yaw = pose_WA
        target_x, target_y = self._p_WT
        return (
            not silent
            and chance >= self._parameters.dropout
            and in_field_of_view(
                math.atan2(target_y - y, target_x - x) - yaw,
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

    Args:
        parameters: how what it believes differs from the base's figures.
        base: those figures.
        start: X_WB at the start, [x, y, yaw] in m and rad.
        rate: samples a second [Hz].
    """

    def __init__(
        self,
        parameters: OdometryParameters,
        base: DifferentialDrive,
        start: Sequence[float],
        rate: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._base = believed_base(base, parameters)
        self._wheels = self.DeclareVectorInputPort(
            "measured_wheel_state", size(WheelState)
        )
        pose = self.DeclareDiscreteState(start)
        velocity = self.DeclareDiscreteState(size(BaseVelocity))
        last_angles = self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("measured_base_pose", pose)
        self.DeclareStateOutputPort("measured_base_velocity", velocity)
        # Whole numbers: Drake's own indices take longer to hand over.
        self._pose, self._velocity = int(pose), int(velocity)
        self._last_angles = int(last_angles)
        self.DeclarePeriodicDiscreteUpdateEvent(1 / rate, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        left, right, *speeds = self._wheels.Eval(context).tolist()
        ticks = self._parameters.encoder_ticks
        left, right = count_ticks(left, ticks), count_ticks(right, ticks)
        last_left, last_right = (
            context.get_discrete_state(self._last_angles).value().tolist()
        )
        state.set_value(
            self._pose,
            integrate_wheels(
                context.get_discrete_state(self._pose).value().tolist(),
                scale_wheels(
                    (left - last_left, right - last_right), self._parameters
                ),
                self._base,
            ),
        )
        state.set_value(
            self._velocity,
            self._base.body_velocity(*scale_wheels(speeds, self._parameters)),
        )
        state.set_value(self._last_angles, (left, right))


class ScanMatching(LeafSystem):
    """Corrects odometry by what the lidar sees.

    .. pydrake_system::

        name: ScanMatching
        input_ports:
        - odometry_pose
        - lidar_ranges
        output_ports:
        - measured_base_pose

    - odometry_pose (3): PlanarPose by the wheels alone.
    - lidar_ranges (rays): [m], as `ray_angles` orders them.
    - measured_base_pose (3): PlanarPose in W.

    Direct feedthrough.

    Args:
        parameters: when to believe what.
        lidar: whose ranges these are.
        delay: after the lidar's samples [s].
    """

    def __init__(
        self,
        parameters: ScanMatchingParameters,
        lidar: LidarParameters,
        delay: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._range_max = lidar.range_max
        self._odometry = self.DeclareVectorInputPort(
            "odometry_pose", size(PlanarPose)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        self._memory = int(
            self.DeclareAbstractState(Value(ScanMatchingState()))
        )
        self.DeclareVectorOutputPort(
            "measured_base_pose", size(PlanarPose), self._calc
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / lidar.rate, delay, self._update
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        memory = context.get_abstract_state(self._memory).get_value()
        odometry = self._odometry.Eval(context).tolist()
        output.SetFromVector(compose(memory.correction, odometry))

    def _update(self, context: Context, state: State) -> None:
        memory = match(
            context.get_abstract_state(self._memory).get_value(),
            self._odometry.Eval(context),
            self._ranges.Eval(context),
            self._range_max,
            self._parameters,
        )
        state.get_mutable_abstract_state(self._memory).set_value(memory)


class FloorPlanLocalization(LeafSystem):
    """Holds the pose to a floor plan by what the lidar sees.

    .. pydrake_system::

        name: FloorPlanLocalization
        input_ports:
        - odometry_pose
        - lidar_ranges
        output_ports:
        - measured_base_pose
        - pose_covariance

    - odometry_pose (3): PlanarPose in odometry's frame, which is W at
      the start.
    - lidar_ranges (rays): [m], as `ray_angles` orders them.
    - measured_base_pose (3): PlanarPose in W, the floor plan's.
    - pose_covariance (9): of its x, y and yaw, row by row [m, rad].

    Direct feedthrough.

    Args:
        parameters: how far odometry, lidar and floor plan are believed.
        lidar: whose ranges these are.
        field: of the floor plan.
        delay: after the lidar's samples [s].
    """

    def __init__(
        self,
        parameters: LocalizationParameters,
        lidar: LidarParameters,
        field: DistanceField,
        delay: float,
    ) -> None:
        super().__init__()
        self._parameters = parameters
        self._range_max = lidar.range_max
        self._field = field
        self._odometry = self.DeclareVectorInputPort(
            "odometry_pose", size(PlanarPose)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        self._memory = int(self.DeclareAbstractState(Value(begin(parameters))))
        self.DeclareVectorOutputPort(
            "measured_base_pose", size(PlanarPose), self._calc_pose
        )
        self.DeclareVectorOutputPort(
            "pose_covariance", 9, self._calc_covariance
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            1 / lidar.rate, delay, self._update
        )

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        memory = context.get_abstract_state(self._memory).get_value()
        odometry = self._odometry.Eval(context).tolist()
        output.SetFromVector(compose(memory.correction, odometry))

    def _calc_covariance(self, context: Context, output: BasicVector) -> None:
        memory = context.get_abstract_state(self._memory).get_value()
        odometry = tuple(self._odometry.Eval(context).tolist())
        now = predict(memory, odometry, self._parameters)
        output.SetFromVector(now.covariance.ravel())

    def _update(self, context: Context, state: State) -> None:
        memory = localize(
            context.get_abstract_state(self._memory).get_value(),
            self._odometry.Eval(context),
            self._ranges.Eval(context),
            self._range_max,
            self._field,
            self._parameters,
        )
        state.get_mutable_abstract_state(self._memory).set_value(memory)
