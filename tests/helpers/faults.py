"""A station's sensors with faults: blocks to exchange for its own."""

import math

import numpy as np
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_mobarm.robot.shape import ANTENNA_POSITION
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.sensors.systems import BeaconSensor, Odometry


class FaultyBeacon(BeaconSensor):
    """Reads the beacon; `fault(time, angle, rssi, valid)` is what it tells."""

    def __init__(self, scenario, fault):
        beacon = Beacon(position=scenario.beacon, noise=scenario.noise)
        super().__init__(
            scenario.station.beacon, beacon, np.array(ANTENNA_POSITION)
        )
        self._fault = fault

    def _update(self, context, state):
        super()._update(context, state)
        reading = state.value().tolist()
        state.set_value(self._fault(context.get_time(), *reading))


class _Falsify(LeafSystem):
    def __init__(self, fault):
        super().__init__()
        self._true = self.DeclareVectorInputPort("true", 3)
        self.DeclareVectorOutputPort(
            "told",
            3,
            lambda context, output: output.SetFromVector(
                fault(context.get_time(), *self._true.Eval(context).tolist())
            ),
        )


def faulty_odometry(scenario, fault):
    """Odometry; `fault(time, x, y, yaw)` is the pose that it tells."""
    builder = DiagramBuilder()
    odometry = builder.AddSystem(
        Odometry(
            scenario.station.odometry,
            scenario.station.base_drive.base,
            scenario.start,
            100.0,
        )
    )
    falsify = builder.AddSystem(_Falsify(fault))
    builder.Connect(
        odometry.GetOutputPort("measured_base_pose"),
        falsify.get_input_port(),
    )
    builder.ExportInput(odometry.get_input_port(), "measured_wheel_state")
    builder.ExportOutput(falsify.get_output_port(), "measured_base_pose")
    builder.ExportOutput(
        odometry.GetOutputPort("measured_base_velocity"),
        "measured_base_velocity",
    )
    return builder.Build()


def between(start, end, broken):
    """A fault that tells `broken(*values)` from start [s] until end [s]."""
    return lambda time, *values: (
        broken(*values) if start <= time < end else values
    )


def louder(decibels):
    """Readings that are louder by so much [dB]."""
    return lambda angle, rssi, valid: (angle, rssi + decibels, valid)


def stuck_at(strength):
    """Readings whose strength is always the same [dBm]."""
    return lambda angle, rssi, valid: (
        angle,
        math.nan if math.isnan(rssi) else strength,
        valid,
    )
