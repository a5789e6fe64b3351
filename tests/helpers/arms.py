"""Arms to test with, and what they should do by other means."""

import itertools
import math

import numpy as np
import pytest

from drake_mobarm.robot import (
    APPENDIX_C,
    WIDOWX_250,
    ArmKinematics,
    ArmParameters,
)

PI = math.pi
TURN = 2 * PI
WIDOWX = ArmKinematics()
# Elbow angle of the straight arm: the dog-leg of 0.04975 m and 0.25 m.
STRAIGHT = -math.atan2(0.25, 0.04975)

FREE = {
    "lower": [-PI] * 6,
    "upper": [PI] * 6,
    "torque_limit": [100.0] * 6,
    "mass": [9.0, 17.4, 4.8, 0.82, 0.34, 0.09],
    "com": np.linspace(-0.3, 0.4, 18).reshape(6, 3),
}
# Public figures: a lateral offset, and a forearm that is off its axis.
PUMA_560 = ArmParameters(
    dh=[
        [0.0, 0.6718, 0.0, PI / 2],
        [0.0, 0.0, 0.4318, 0.0],
        [0.0, 0.15005, 0.0203, -PI / 2],
        [0.0, 0.4318, 0.0, PI / 2],
        [0.0, 0.0, 0.0, -PI / 2],
        [0.0, 0.05625, 0.0, 0.0],
    ],
    **FREE,
)
# As arms in factories are: the shoulder's axis does not meet the waist's.
INDUSTRIAL = ArmParameters(
    dh=[
        [0.3, 0.45, 0.15, -PI / 2],
        [-PI / 2, 0.0, 0.6, 0.0],
        [0.0, 0.0, 0.12, -PI / 2],
        [0.0, 0.64, 0.0, PI / 2],
        [0.0, 0.0, 0.0, -PI / 2],
        [-0.7, 0.1, 0.0, 0.0],
    ],
    **FREE,
)
ARMS = {
    "widowx": WIDOWX_250,
    "appendix_c": APPENDIX_C,
    "puma": PUMA_560,
    "industrial": INDUSTRIAL,
}
# Every way in which the axes of such an arm may turn, other figures in each.
TURNS = list(itertools.product([-1, 1], [-1, 0, 1], [-1, 1], [-1, 1]))


def turned(index):
    first, third, fourth, fifth = TURNS[index]
    rng = np.random.default_rng(index)
    dh = np.zeros((6, 4))
    dh[:, 0] = rng.uniform(-3, 3, 6)
    dh[:, 1] = rng.uniform(-0.1, 0.2, 6)
    dh[3, 1] = 0.4
    dh[4, 1] = 0
    dh[:3, 2] = rng.uniform([-0.1, 0.3, 0.1], [0.1, 0.5, 0.2])
    dh[:, 3] = np.array([first, 0, third, fourth, fifth, 0]) * PI / 2
    return ArmParameters(dh=dh, **FREE)


arms = pytest.mark.parametrize(
    "parameters", ARMS.values(), ids=list(ARMS), scope="module"
)
all_arms = pytest.mark.parametrize(
    "parameters",
    [*ARMS.values(), *map(turned, range(len(TURNS)))],
    ids=[*ARMS, *(f"turns{''.join(f'{x:+d}' for x in t)}" for t in TURNS)],
)

# Oracles, (n, 6) in


def frames(parameters, q):
    """DH frames 0 to 6, (7, n, 4, 4), each by one product of matrices."""
    q = np.asarray(q, dtype=float)
    chain = [np.broadcast_to(np.eye(4), (len(q), 4, 4))]
    for (offset, d, a, alpha), angle in zip(parameters.dh, q.T, strict=True):
        c, s = np.cos(angle + offset), np.sin(angle + offset)
        ca, sa = np.cos(alpha), np.sin(alpha)
        zero, one = np.zeros_like(c), np.ones_like(c)
        A = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [zero, sa * one, ca * one, d * one],
            [zero, zero, zero, one],
        ]
        chain.append(chain[-1] @ np.moveaxis(np.array(A), 2, 0))
    return np.array(chain)


# Axes of the tool's frame in frame 6: x = z6, y = -y6, z = x6.
X_6T = np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])


def pose(parameters, q):
    return frames(parameters, q)[6] @ X_6T


def jacobian_at(parameters, q, frame):
    """Of the origin of a DH frame, axis by axis."""
    X = frames(parameters, q)
    axes = X[:6, :, :3, 2]
    levers = X[frame, None, :, :3, 3] - X[:6, :, :3, 3]
    return np.concatenate([np.cross(axes, levers), axes], axis=2).transpose(
        1, 2, 0
    )


def regular(parameters, q):
    """Where arm and wrist are away from their singularities."""
    J = jacobian_at(parameters, q, 5)
    arm, wrist = J[:, :3, :3], J[:, 3:, 3:]
    return (np.abs(np.linalg.det(arm)) > 2e-4) & (
        np.abs(np.linalg.det(wrist)) > 1e-3
    )


def apart(q, other):
    """Largest difference of any joint, modulo a turn."""
    return np.abs((q - other + PI) % TURN - PI).max(axis=-1)


def check_poses(parameters, solutions, X_BT, tolerance=1e-8):
    """Whole rows of NaN or right poses. Returns how many for each pose."""
    nan = np.isnan(solutions)
    there = ~nan.any(axis=-1)
    np.testing.assert_array_equal(there, ~nan.all(axis=-1))
    index = np.nonzero(there)[0]
    reached = pose(parameters, solutions[there])
    assert np.abs(reached - X_BT[index]).max(initial=0.0) < tolerance
    return there.sum(axis=1)


def random_q(parameters, n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(parameters.lower, parameters.upper, (n, 6))


def small(rng, n, least=-16.0, most=-1.0):
    """Log-uniform, of either sign; a tenth of it zero."""
    size = 10 ** rng.uniform(least, most, n) * rng.choice([-1, 1], n)
    return np.where(rng.random(n) < 0.1, 0.0, size)


# Poses at and near singularities


def waist_singular(q, radius, sign):
    """Sets the shoulder so that the wrist's centre is at a radius.

    With the links of the URDF in the plane: the dog-leg turned by the
    shoulder, the forearm by shoulder and elbow.
    """
    forward = 0.04975 + 0.25 * np.cos(q[:, 2])
    up = 0.25 - 0.25 * np.sin(q[:, 2])
    lean = np.arccos(np.clip(radius / np.hypot(forward, up), -1, 1))
    q[:, 1] = np.arctan2(up, forward) + sign * lean


def singular_q(kind, n=10_000, parameters=WIDOWX_250):
    rng = np.random.default_rng(5)
    q = rng.uniform(parameters.lower, parameters.upper, (n, 6))
    straight = STRAIGHT if parameters is WIDOWX_250 else 0.0
    if kind == "threshold":
        q[:, 4] = small(rng, n, -13, -9)
    if kind in ("wrist", "wrist and elbow", "all"):
        q[:, 4] = small(rng, n)
    if kind in ("elbow", "wrist and elbow", "all"):
        q[:, 2] = straight + small(rng, n)
    if kind == "folded":
        q[:, 2] = straight + PI + small(rng, n)
    if kind in ("waist", "waist and wrist", "all"):
        waist_singular(q, small(rng, n), rng.choice([-1, 1], n))
    if kind == "waist and wrist":
        q[:, 4] = small(rng, n)
    if kind == "upright":
        q[:, 2], q[:, 4] = straight, 0.0  # All at once, the tool straight up.
        waist_singular(q, np.zeros(n), -1)
    return q


KINDS = [
    *("wrist", "threshold", "elbow", "folded", "waist", "upright"),
    *("wrist and elbow", "waist and wrist", "all"),
]
