"""What Tables 2.3 and 2.4 report of a run, as their footnotes define it."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.geometry import Array, is_pose
from drake_mobarm.homing.screening import is_possible_strength
from drake_mobarm.sensors.rssi import RssiModel

SUCCESS_DISTANCE = 1.0
"""A run that ends by itself nearer than this to the target succeeded [m]."""


def homing_metrics(
    trace: Mapping[str, Array], beacon: ArrayLike
) -> dict[str, float]:
    """The metrics of one run, up to its end: the robot may still roll then.

    Args:
        trace: `t` (n,) [s], `ground_truth` (n, 7), `estimated_target` (n, 3),
            named as in `signals`.
        beacon: true p_WT [m], (2,).

    Returns:
        Time to the end, net velocity (straight line from start to end over
        time), goal position error (estimate to beacon; NaN without one),
        final position error (robot to beacon), path efficiency (straight
        line from start to end over distance travelled; 1 for a robot that
        never left), distance travelled, contacts with obstacles.
    """
    position = trace["ground_truth"][:, :2]
    time = float(trace["t"][-1])
    straight = float(np.linalg.norm(position[-1] - position[0]))
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    travelled = float(steps.sum())
    goal_error = trace["estimated_target"][-1, :2] - np.asarray(beacon)
    final_error = position[-1] - np.asarray(beacon)
    return {
        "time_to_target_s": time,
        "net_velocity_m_per_s": straight / time if time > 0 else 0.0,
        "goal_position_error_m": float(np.linalg.norm(goal_error)),
        "final_position_error_m": float(np.linalg.norm(final_error)),
        "path_efficiency": straight / travelled if travelled > 0 else 1.0,
        "distance_travelled_m": travelled,
        "contacts": float(trace["ground_truth"][-1, 6]),
    }


def count_dropped(
    trace: Mapping[str, Array], calibration: RssiModel
) -> dict[str, float]:
    """How many of the trace's samples no estimator can use.

    Args:
        trace: `measured_base_pose` (n, 3), `beacon_reading` (n, 3).
        calibration: of the beacon.

    Returns:
        Poses that cannot be one, and readings that are marked valid and are
        not finite or have a strength that no beacon has.
    """
    poses = trace["measured_base_pose"].tolist()
    heard = trace["beacon_reading"]
    heard = heard[heard[:, 2] > 0.5].tolist()
    return {
        "poses_dropped": float(sum(not is_pose(pose) for pose in poses)),
        "readings_dropped": float(
            sum(
                not (
                    np.isfinite(angle)
                    and is_possible_strength(rssi, calibration)
                )
                for angle, rssi, _ in heard
            )
        ),
    }


def judge(
    metrics: Mapping[str, float],
    arrived: bool,
    time_limit: float,
    shut: tuple[float, float] | None = None,
) -> tuple[bool, str]:
    """Whether the robot did its job, and why or why not.

    Args:
        metrics: of the run.
        arrived: whether it ended by itself at the target.
        time_limit: of the run [s].
        shut: where the robot found no way on and gave up [m], if it did.
    """
    error = metrics["final_position_error_m"]
    if not arrived and shut is not None:
        x, y = shut
        return False, f"gave up: no way on was found at [{x:.2f}, {y:.2f}]"
    if not arrived:
        return False, f"time limit of {time_limit:g} s reached"
    if not error < SUCCESS_DISTANCE:
        return False, f"ended {error:.2f} m from the beacon"
    return True, "arrived at the beacon"
