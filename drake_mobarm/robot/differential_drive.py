"""Kinematics and dynamics of the base: sections 7.3.1.1 and 7.3.1.2."""

from collections.abc import Sequence
from typing import Any

from drake_mobarm.checks import finite, positive
from drake_mobarm.frozen import frozen


@frozen
class DifferentialDrive:
    """The differential-drive base, with the arm stowed.

    The defaults are those of `models/mobile_arm.urdf`; `tests` compares them
    with the plant.

    Attributes:
        wheel_radius: r [m].
        track: distance between the wheels' contact points [m], the w of
            section 7.3.1.1; here w is a turn rate.
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
        finite(self, "com_offset")
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

    def body_velocity(self, left: Any, right: Any) -> tuple[Any, Any]:
        """(v, w) [m/s, rad/s] of wheel speeds [rad/s]; (7.1), (7.2).

        Numbers, or arrays of one shape; so are v and w.
        """
        r, track = self.wheel_radius, self.track
        return r * (right + left) / 2, r * (right - left) / track

    def wheel_speeds(self, v: Any, w: Any) -> tuple[Any, Any]:
        """Left, right [rad/s] of v [m/s] and w [rad/s]; (7.4), (7.3).

        Numbers, or arrays of one shape; so are left and right.
        """
        r, half = self.wheel_radius, self.track / 2
        return (v - half * w) / r, (v + half * w) / r

    def wheel_torques(
        self, velocity: Sequence[float], acceleration: Sequence[float]
    ) -> tuple[float, float]:
        """Torques that give an acceleration: (7.6), (7.7) solved for them.

        Args:
            velocity: (v, w) [m/s, rad/s].
            acceleration: their time derivatives [m/s^2, rad/s^2].

        Returns:
            Left, right [N m], not limited.
        """
        (v, w), (dv, dw) = velocity, acceleration
        r, track, I_w = self.wheel_radius, self.track, self.wheel_inertia
        lever = self.body_mass * self.com_offset
        total = r * ((self.mass + 2 * I_w / r**2) * dv - lever * w**2)
        difference = (2 * r / track) * (
            (self.inertia + track**2 / (2 * r**2) * I_w) * dw + lever * w * v
        )
        return (total - difference) / 2, (total + difference) / 2
