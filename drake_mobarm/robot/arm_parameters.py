"""Parameters of six-joint arms: Denavit-Hartenberg rows, limits, masses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import require
from drake_mobarm.geometry import Array

JOINTS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmParameters:
    """Parameters of a six-joint arm with a spherical wrist.

    Attributes:
        dh: Denavit-Hartenberg rows, (6, 4), one for each joint: offset of
            theta [rad], d [m], a [m], alpha [rad]. Standard convention:
            frame i is frame i - 1 moved by
            Rz(q + offset) Tz(d) Tx(a) Rx(alpha).
        lower: joint limits [rad], (6,).
        upper: joint limits [rad], (6,).
        torque_limit: r, the largest torque of each joint [N m], (6,).
        mass: of the link that each joint moves [kg], (6,).
        com: p_BC, the centres of mass of those links at q = 0 [m], (6, 3).

    Raises:
        ParameterError: a shape is wrong or a value is out of its range.
    """

    dh: ArrayLike
    lower: ArrayLike
    upper: ArrayLike
    torque_limit: ArrayLike
    mass: ArrayLike
    com: ArrayLike

    def __post_init__(self) -> None:
        for field, shape in (
            ("dh", (JOINTS, 4)),
            ("lower", (JOINTS,)),
            ("upper", (JOINTS,)),
            ("torque_limit", (JOINTS,)),
            ("mass", (JOINTS,)),
            ("com", (JOINTS, 3)),
        ):
            given = getattr(self, field)
            try:
                array: Array = np.array(given, dtype=float)
            except (TypeError, ValueError):
                array = np.empty(0)  # Of no shape that is right.
            require(
                array.shape == shape and bool(np.isfinite(array).all()),
                field,
                np.asarray(given, dtype=object).tolist(),
                f"{shape}, finite",
            )
            array.setflags(write=False)
            object.__setattr__(self, field, array)
        require(
            bool(np.all(np.less(self.lower, self.upper))),
            "lower",
            np.asarray(self.lower).tolist(),
            "below upper",
        )
        for field, least in (("torque_limit", 0.01), ("mass", 0.0)):
            value = getattr(self, field)
            require(
                bool(np.all(value >= least)),
                field,
                value.tolist(),
                f"{least} or more",
            )


_ELBOW = (0.04975, 0.25)
"""From the shoulder's axis to the elbow's at q = 0, forward and up [m]."""

_BETA = float(np.arctan2(*_ELBOW))

WIDOWX_250 = ArmParameters(
    dh=[
        [0.0, 0.11065, 0.0, -np.pi / 2],
        [_BETA - np.pi / 2, 0.0, float(np.hypot(*_ELBOW)), 0.0],
        [-_BETA, 0.0, 0.0, -np.pi / 2],
        [0.0, 0.25, 0.0, np.pi / 2],
        [0.0, 0.0, 0.0, -np.pi / 2],
        [0.0, 0.158575, 0.0, 0.0],
    ],
    lower=[-np.pi, -1.884956, -2.146755, -np.pi, -1.745329, -np.pi],
    upper=[np.pi, 1.989675, 1.605703, np.pi, 2.146755, np.pi],
    torque_limit=[4.1, 8.2, 8.2, 4.1, 4.1, 1.5],
    mass=[0.480879, 0.430811, 0.234589, 0.220991, 0.084957, 0.143916],
    com=[
        [0.0000223, 0.0000415, 0.0786287],
        [0.0171605, 0.0, 0.301973],
        [0.157713, 0.0001159, 0.36065],
        [0.2621895, 0.0052225, 0.36065],
        [0.34211, -0.0000107, 0.371227],
        [0.407733, 0.0, 0.367609],
    ],
)
"""Interbotix WidowX 250 6DOF: forearm roll and spherical wrist.

Chain, limits and masses are those of `models/mobile_arm.urdf`, but for the
waist, forearm roll and wrist rotation, which turn by half a turn each way as
the maker states: the URDF's limits are 1e-5 rad narrower, and would shut out
the half turns that every flipped wrist with an upright tool needs.
"""

APPENDIX_C = ArmParameters(
    dh=[
        [0.0, 0.11065, 0.0, np.pi / 2],
        [0.0, 0.0, float(np.hypot(*_ELBOW)), 0.0],
        [0.0, 0.0, 0.25, 0.0],
        [0.0, 0.0, 0.0, -np.pi / 2],
        [0.0, 0.0, 0.0, np.pi / 2],
        [0.0, 0.158575, 0.0, 0.0],
    ],
    lower=[-np.pi] * JOINTS,
    upper=[np.pi] * JOINTS,
    torque_limit=[4.1, 8.2, 8.2, 4.1, 4.1, 1.5],
    mass=[0.480879, 0.430811, 0.45558, 0.0, 0.084957, 0.143916],
    com=[
        [0.0000223, 0.0000415, 0.0786287],
        [0.190993, 0.0, 0.131161],
        [0.413544, 0.002593, 0.11065],
        [0.504902, 0.0, 0.11065],
        [0.504891, -0.04236, 0.121227],
        [0.504902, -0.107983, 0.117609],
    ],
)
"""The arm of Appendix C: the fourth joint's axis is parallel to the elbow's.

The dissertation gives no figures; these are the WidowX's lengths, torque
limits and masses, its forearm in one piece, and joints that turn freely. At
q = 0 the arm is stretched forward and the tool points to the right.
"""
