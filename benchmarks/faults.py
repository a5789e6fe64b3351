"""Sixty faults of odometry, lidar and beacon, as blocks in their places.

A faulty sensor is the shipped one with a function of time behind each of its
outputs. Such a function may remember what went through: it is made anew for
every run.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    System,
)

from drake_mobarm.geometry import Array
from drake_mobarm.homing.job import HomingScenario
from drake_mobarm.robot.shape import ANTENNA_POSITION, LIDAR_HEIGHT
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.sensors.systems import BeaconSensor, Lidar, Odometry
from drake_mobarm.world.obstacles import outlines, outlines_to_segments
from drake_mobarm.world.sdf import load_world

Change = Callable[[float, Array], Array]
"""What becomes of a signal: of the time [s] and the true value."""

ODOMETRY_RATE = 100.0  # The station's [Hz].
ANGLE, RSSI = 0, 1  # Of a beacon's reading.
X, Y, YAW = 0, 1, 2  # Of a pose.
LOST = np.array([np.nan, np.nan, 0.0])
"""A reading where nothing is heard."""


class Corruption(LeafSystem):
    """Changes a signal on its way.

    Args:
        signal: its name.
        elements: its number of elements.
        change: what becomes of it.
    """

    def __init__(self, signal: str, elements: int, change: Change) -> None:
        super().__init__()
        self._change = change
        self._input = self.DeclareVectorInputPort(signal, elements)
        self.DeclareVectorOutputPort(signal, elements, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        value = np.array(self._input.Eval(context))
        output.SetFromVector(self._change(context.get_time(), value))


def corrupt(sensor: System, changes: Mapping[str, Change]) -> Diagram:
    """A sensor with changes behind some of its outputs, by their names."""
    builder = DiagramBuilder()
    builder.AddSystem(sensor)
    for index in range(sensor.num_input_ports()):
        port = sensor.get_input_port(index)
        builder.ExportInput(port, port.get_name())
    for index in range(sensor.num_output_ports()):
        port = sensor.get_output_port(index)
        name = port.get_name()
        if name in changes:
            corruption = builder.AddSystem(
                Corruption(name, port.size(), changes[name])
            )
            builder.Connect(port, corruption.get_input_port())
            port = corruption.get_output_port()
        builder.ExportOutput(port, name)
    return builder.Build()


def make_blocks(name: str, scenario: HomingScenario) -> dict[str, System]:
    """The block that a fault exchanges, for `run`."""
    changes = {signal: make() for signal, make in FAULTS[name].items()}
    station = scenario.station
    if "lidar_ranges" in changes:
        obstacles = load_world(scenario.world).obstacles
        cut = outlines(obstacles, LIDAR_HEIGHT, LIDAR_HEIGHT)
        lidar = Lidar(station.lidar, *outlines_to_segments(cut))
        return {"lidar": corrupt(lidar, changes)}
    if "beacon_reading" in changes:
        beacon = Beacon(position=scenario.beacon, noise=scenario.noise)
        p_BA = np.array(ANTENNA_POSITION)
        antenna = BeaconSensor(station.beacon, beacon, p_BA)
        return {"beacon": corrupt(antenna, changes)}
    wheels = Odometry(
        station.odometry,
        station.base_drive.base,
        scenario.start,
        ODOMETRY_RATE,
    )
    return {"odometry": corrupt(wheels, changes)}


# Changes


def replaced(value: float, *elements: int) -> Change:
    """Elements, or all, are a value."""

    def change(t: float, signal: Array) -> Array:
        signal[list(elements) if elements else slice(None)] = value
        return signal

    return change


def added(value: float, element: int) -> Change:
    """A value is added to an element."""

    def change(t: float, signal: Array) -> Array:
        signal[element] += value
        return signal

    return change


def scaled(factor: float) -> Change:
    """Every element is multiplied."""
    return lambda t, signal: factor * signal


def noisy(deviation: float, *elements: int) -> Change:
    """Gaussian noise on elements, or on all."""
    rng = np.random.default_rng(0)

    def change(t: float, signal: Array) -> Array:
        chosen = list(elements) if elements else slice(None)
        signal[chosen] += rng.normal(0, deviation, signal[chosen].shape)
        return signal

    return change


def frozen() -> Change:
    """The first value stays."""
    first: list[Array] = []

    def change(t: float, signal: Array) -> Array:
        if not first:
            first.append(signal)
        return first[0]

    return change


def delayed(seconds: float) -> Change:
    """Comes later."""
    passed: list[tuple[float, Array]] = []

    def change(t: float, signal: Array) -> Array:
        passed.append((t, signal))
        while len(passed) > 1 and passed[1][0] <= t - seconds:
            passed.pop(0)
        return passed[0][1]

    return change


def between(start: float, end: float, change: Change) -> Change:
    """A change for a while [s]."""
    return lambda t, signal: change(t, signal) if start <= t < end else signal


def after(start: float, change: Change) -> Change:
    """A change from a time [s] on."""
    return between(start, math.inf, change)


def sometimes(chance: float, change: Change) -> Change:
    """A change of some values: a new draw every time the value changes."""
    rng = np.random.default_rng(0)
    last: list[tuple[Array, bool]] = []

    def maybe(t: float, signal: Array) -> Array:
        if not last or not np.array_equal(last[0][0], signal, equal_nan=True):
            last[:] = [(signal.copy(), bool(rng.uniform() < chance))]
        return change(t, signal) if last[0][1] else signal

    return maybe


def moved(dx: float, turn: float) -> Change:
    """A pose from its first value on in axes moved along x and turned."""
    first: list[Array] = []

    def change(t: float, pose: Array) -> Array:
        if not first:
            first.append(pose.copy())
        (x, y), (c, s) = (
            pose[:2] - first[0][:2],
            (math.cos(turn), math.sin(turn)),
        )
        return first[0] * [1, 1, 0] + np.array(
            [dx + c * x - s * y, s * x + c * y, pose[YAW] + turn]
        )

    return change


def stretched(factor: float) -> Change:
    """A pose whose way from its first value on is longer."""
    first: list[Array] = []

    def change(t: float, pose: Array) -> Array:
        if not first:
            first.append(pose.copy())
        pose[:2] = first[0][:2] + factor * (pose[:2] - first[0][:2])
        return pose

    return change


def slipping(start: float, end: float, factor: float) -> Change:
    """A pose whose way is longer for a while, and never corrected."""
    last: list[Array] = []
    measured: list[Array] = []

    def change(t: float, pose: Array) -> Array:
        if not last:
            last.append(pose.copy())
            measured.append(pose.copy())
        share = factor if start <= t < end else 1.0
        measured[0] += (pose - last[0]) * [share, share, 1.0]
        last[0] = pose.copy()
        return measured[0]

    return change


def drifting(rate: float, element: int) -> Change:
    """An element grows by so much a second."""
    return lambda t, signal: added(rate * t, element)(t, signal)


def blind(first: int, last: int, value: float) -> Change:
    """Rays from one to another, of a scan, are a value."""

    def change(t: float, ranges: Array) -> Array:
        ranges[first:last] = value
        return ranges

    return change


def silenced() -> Change:
    """Nothing is heard."""
    return lambda t, signal: LOST


def _pose(make: Callable[[], Change]) -> dict[str, Callable[[], Change]]:
    return {"measured_base_pose": make}


def _velocity(make: Callable[[], Change]) -> dict[str, Callable[[], Change]]:
    return {"measured_base_velocity": make}


def _lidar(make: Callable[[], Change]) -> dict[str, Callable[[], Change]]:
    return {"lidar_ranges": make}


def _beacon(make: Callable[[], Change]) -> dict[str, Callable[[], Change]]:
    return {"beacon_reading": make}


NAN, INF, HUGE = math.nan, math.inf, 1e300

FAULTS: dict[str, dict[str, Callable[[], Change]]] = {
    "pose NaN for 0.2 s": _pose(lambda: between(5, 5.2, replaced(NAN))),
    "pose NaN from 5 s": _pose(lambda: after(5, replaced(NAN))),
    "pose NaN until 2 s": _pose(lambda: between(0, 2, replaced(NAN))),
    "pose infinite for 0.2 s": _pose(lambda: between(5, 5.2, replaced(INF))),
    "pose 1e300 for 0.2 s": _pose(lambda: between(5, 5.2, replaced(HUGE))),
    "pose 1e300 from 8 s": _pose(lambda: after(8, replaced(HUGE))),
    "x 1e300 for one sample": _pose(
        lambda: between(5, 5.01, replaced(HUGE, X))
    ),
    "yaw NaN for 1 s": _pose(lambda: between(5, 6, replaced(NAN, YAW))),
    "pose frozen for 2 s": _pose(lambda: between(6, 8, frozen())),
    "pose frozen from 6 s": _pose(lambda: after(6, frozen())),
    "pose delayed by 0.3 s": _pose(lambda: delayed(0.3)),
    "pose delayed by 1 s": _pose(lambda: delayed(1.0)),
    "way a tenth too long": _pose(lambda: stretched(1.1)),
    "way a tenth too short": _pose(lambda: stretched(0.9)),
    "heading jumps half a turn": _pose(lambda: after(6, moved(0, math.pi))),
    "heading jumps a quarter turn": _pose(lambda: after(6, moved(0, 1.571))),
    "position jumps 3 m": _pose(lambda: after(6, moved(3, 0))),
    "heading drifts 0.02 rad/s": _pose(lambda: drifting(0.02, YAW)),
    "pose noisy by 0.05": _pose(lambda: noisy(0.05)),
    "wheels slip for 3 s": _pose(lambda: slipping(5, 8, 1.5)),
    "velocity NaN": _velocity(lambda: replaced(NAN)),
    "velocity 1e300": _velocity(lambda: replaced(HUGE)),
    "velocity always zero": _velocity(lambda: replaced(0.0)),
    "scan all zero": _lidar(lambda: replaced(0.0)),
    "scan all at the longest": _lidar(lambda: replaced(12.0)),
    "scan all NaN": _lidar(lambda: replaced(NAN)),
    "scan all NaN for 2 s": _lidar(lambda: between(5, 7, replaced(NAN))),
    "scan all infinite": _lidar(lambda: replaced(INF)),
    "scan negative": _lidar(lambda: replaced(-1.0)),
    "scan 1e300": _lidar(lambda: replaced(HUGE)),
    "scan half NaN": _lidar(lambda: blind(0, 180, NAN)),
    "scan half at the longest": _lidar(lambda: blind(180, 360, 12.0)),
    "scan half zero": _lidar(lambda: blind(90, 270, 0.0)),
    "scan frozen from 5 s": _lidar(lambda: after(5, frozen())),
    "scan delayed by 0.5 s": _lidar(lambda: delayed(0.5)),
    "scan noisy by 0.3 m": _lidar(lambda: noisy(0.3)),
    "scan of half the ranges": _lidar(lambda: scaled(0.5)),
    "angle NaN, valid": _beacon(lambda: replaced(NAN, ANGLE)),
    "strength NaN, valid": _beacon(lambda: replaced(NAN, RSSI)),
    "reading infinite, valid": _beacon(lambda: replaced(INF, ANGLE, RSSI)),
    "reading 1e300, valid": _beacon(lambda: replaced(HUGE, ANGLE, RSSI)),
    "reading all NaN": _beacon(lambda: replaced(NAN)),
    "strength stuck near": _beacon(lambda: replaced(-40.0, RSSI)),
    "strength stuck near from 5 s": _beacon(
        lambda: after(5, replaced(-40.0, RSSI))
    ),
    "strength 10 dB too high": _beacon(lambda: added(10, RSSI)),
    "strength 10 dB too low": _beacon(lambda: added(-10, RSSI)),
    "strength +100 dBm for 1 s": _beacon(
        lambda: between(5, 6, replaced(100, RSSI))
    ),
    "strength -400 dBm for 3 s": _beacon(
        lambda: between(5, 8, replaced(-400, RSSI))
    ),
    "strength noisy by 10 dB": _beacon(lambda: noisy(10, RSSI)),
    "strength 30 dB too high for a tenth": _beacon(
        lambda: sometimes(0.1, added(30, RSSI))
    ),
    "97 % lost": _beacon(lambda: sometimes(0.97, silenced())),
    "nothing heard from the start": _beacon(silenced),
    "nothing heard until 20 s": _beacon(lambda: between(0, 20, silenced())),
    "nothing heard from 5 to 15 s": _beacon(lambda: between(5, 15, silenced())),
    "reading frozen from 5 s": _beacon(lambda: after(5, frozen())),
    "reading delayed by 1 s": _beacon(lambda: delayed(1.0)),
    "angle of the other sign": _beacon(
        lambda: lambda t, r: r * np.array([-1, 1, 1])
    ),
    "antenna backwards": _beacon(lambda: added(math.pi, ANGLE)),
    "angle 0.5 rad off": _beacon(lambda: added(0.5, ANGLE)),
    "angle reflected for a fifth": _beacon(
        lambda: sometimes(0.2, added(1.5, ANGLE))
    ),
}
