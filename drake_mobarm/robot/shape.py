"""The shipped robot's figures: those of `models/mobile_arm.urdf`, once.

Frames: B is the base, its origin on the floor midway between the wheels, x
forward. Tests hold every figure against the URDF.
"""

from pathlib import Path

URDF = Path(__file__).resolve().parent.parent / "models" / "mobile_arm.urdf"
"""The model that Drake simulates and draws."""

RADIUS = 0.27
"""Of the round chassis, about the vertical through B [m]."""

HEIGHTS = (0.01, 0.6)
"""Between these heights over the floor the robot, its arm stowed, can touch
something [m]: the chassis begins at 0.015 m, the stowed arm ends below 0.6."""

CHASSIS_TOP = 0.2965
"""Height of the chassis over the floor [m]."""

ARM_BASE_HEIGHT = CHASSIS_TOP
"""Height of the arm's base over the floor [m]: it stands on the chassis, on
the vertical through B, its axes along B's."""

LIDAR_HEIGHT = 0.20
"""Height of the lidar's scan over the floor [m]; its axes are B's."""

ANTENNA_POSITION = (0.2, 0.0)
"""p_BA of the antenna array on the floor plan [m]; its axes are B's."""

STOWED = (0.0, -1.1, 1.55, 0.0, 0.5, 0.0)
"""Joint positions that keep the arm within the chassis' outline [rad]."""

ROLLING_BODIES = ("wheel_left", "wheel_right", "caster_front", "caster_rear")
"""The bodies that touch the floor."""

LINK_RADIUS = 0.04
"""Of the thickest link of the arm, and a centimetre to be safe [m]."""

WAIST_COLUMN = (0.05, 0.132)
"""Radius of the column that the waist turns, and its height over the arm's
base [m]."""

GRIPPER = (0.0955, 0.042)
"""Where the gripper is widest: from the wrist's centre along the approach, and
to either side along the tool's y axis [m]."""
