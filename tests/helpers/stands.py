"""Arms, objectives, floors and targets to place a robot for."""

from dataclasses import replace

import numpy as np

from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
)
from drake_mobarm.placement.problem import StandProblem, ToolTarget
from drake_mobarm.robot import WIDOWX_250, ArmKinematics
from drake_mobarm.robot.shape import RADIUS

ARM = ArmKinematics(WIDOWX_250)
PLAIN = ObjectiveParameters()
OBJECTIVE = PlacementObjective(ARM, PLAIN)
# Nothing at its default, no two numbers alike.
ODD = ObjectiveParameters(
    torque_weight=0.7,
    position_weight=1.9,
    attitude_weight=0.4,
    torque_shape=[5.0, 8.3, 11.0, 4.2, 4.5, 2.0],
    singularity=0.0031,
    position_axes=[0.3, -0.8, 2.1],
    position_axis_weights=[1.0, 0.0, 2.5],
    attitude_axes=[-1.2, 0.4, 0.9],
    attitude_axis_weights=[0.2, 3.0, 1.0],
    payload=0.35,
)
# The least shape of the torque score has no corner at zero torque.
SMOOTH = replace(ODD, torque_shape=[], position_axis_weights=[1.0, 0.2, 2.5])

OPEN = FreeSpace.from_outlines([], RADIUS, (0, 0), ((-3, -3), (3, 3)))
# On open floor its best stand has no active constraint.
TARGET = ToolTarget(position=[-1.0, 0.5, 0.4], approach=[0.48, -0.36, -0.8])


def problem_of(target, free=OPEN, objective=OBJECTIVE, **others):
    """The problem of a target on open floor, unless told otherwise."""
    return StandProblem(objective=objective, target=target, free=free, **others)


def limited(**limits):
    """The WidowX with other limits: joint_3=(low, high) [rad]."""
    lower, upper = ARM.lower.copy(), ARM.upper.copy()
    for name, (low, high) in limits.items():
        joint = int(name[-1]) - 1
        lower[joint], upper[joint] = low, high
    return PlacementObjective(
        ArmKinematics(replace(WIDOWX_250, lower=lower, upper=upper)), PLAIN
    )


def random_target(rng, low=(-1.5, -1.5), high=(1.5, 1.5), heights=(0.1, 0.8)):
    """Anywhere in a box, along an approach that is not from below."""
    a = rng.normal(size=3)
    a[2] = -abs(a[2])
    return ToolTarget(
        position=rng.uniform([*low, heights[0]], [*high, heights[1]]),
        approach=a / np.linalg.norm(a),
    )


def lattice(target, spacing=0.01, reach=0.67):
    """Places around a target, (n, 2)."""
    steps = np.arange(-reach, reach, spacing)
    x, y = np.meshgrid(steps, steps)
    return target.p_WT[:2] + np.column_stack([x.ravel(), y.ravel()])


def random_joints(seed, shape=()):
    """Joint positions within the limits, (*shape, 6)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(ARM.lower, ARM.upper, (*shape, 6))
