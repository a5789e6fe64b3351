"""Kinematics and dynamics of the base: sections 7.3.1.1 and 7.3.1.2."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from drake_mobarm.checks import positive
from drake_mobarm.geometry import Array


@dataclass(kw_only=True)
class DifferentialDrive:
    """The differential-drive base, with the arm stowed.

    The defaults are those of `models/mobile_arm.urdf`; `tests` compares them
    with the plant.

    Attributes:
        wheel_radius: r [m].
        track: distance w between the wheels' contact points [m].
        mass: m, everything [kg].
        body_mass: m_c, everything but the driving wheels [kg].
        com_offset: d, from the axle's midpoint forward to the centre of
            mass of everything but the wheels [m].
        inertia: I, of everything about the vertical through the axle's
            midpoint [kg m^2].
        wheel_inertia: I_w, of a wheel about its axle [kg m^2].
        wheel_speed_limit: of a wheel [rad/s].
        wheel_acceleration_limit: of a wheel [rad/s^2].
        wheel_torque_limit: of a wheel [N m].
    """

    wheel_radius: float = 0.0985
    track: float = 0.4044
    mass: float = 34.0489
    body_mass: float = 30.4009
    com_offset: float = -0.003235
    inertia: float = 0.7330
    wheel_inertia: float = 0.00839
    wheel_speed_limit: float = 10.15
    wheel_acceleration_limit: float = 10.0
    wheel_torque_limit: float = 6.0

    def __post_init__(self) -> None:
        positive(
            self,
            "wheel_radius",
            "track",
            "mass",
            "body_mass",
            "inertia",
            "wheel_inertia",
            "wheel_speed_limit",
            "wheel_acceleration_limit",
            "wheel_torque_limit",
        )

    def body_velocity(self, wheel_speeds: ArrayLike) -> Array:
        """(v, w) [m/s, rad/s], (..., 2), of wheel speeds; (7.1), (7.2).

        Args:
            wheel_speeds: left, right [rad/s], (..., 2).
        """
        r, w = self.wheel_radius, self.track
        velocity: Array = np.asarray(wheel_speeds) @ np.array(
            [[r / 2, -r / w], [r / 2, r / w]]
        )
        return velocity

    def wheel_speeds(self, velocity: ArrayLike) -> Array:
        """Left, right [rad/s], (..., 2), of (v, w); (7.4), (7.3)."""
        half = self.track / 2
        speeds: Array = (
            np.asarray(velocity)
            @ np.array([[1, 1], [-half, half]])
            / self.wheel_radius
        )
        return speeds

    def wheel_torques(
        self, velocity: ArrayLike, acceleration: ArrayLike
    ) -> Array:
        """Torques that give an acceleration: (7.6), (7.7) solved for them.

        Args:
            velocity: (v, w) [m/s, rad/s], (2,).
            acceleration: their time derivatives [m/s^2, rad/s^2], (2,).

        Returns:
            Left, right [N m], (2,), not limited.
        """
        v, w = np.asarray(velocity, dtype=float)
        dv, dw = np.asarray(acceleration, dtype=float)
        r, track, I_w = self.wheel_radius, self.track, self.wheel_inertia
        lever = self.body_mass * self.com_offset
        total = r * ((self.mass + 2 * I_w / r**2) * dv - lever * w**2)
        difference = (2 * r / track) * (
            (self.inertia + track**2 / (2 * r**2) * I_w) * dw + lever * w * v
        )
        return np.array([total - difference, total + difference]) / 2
