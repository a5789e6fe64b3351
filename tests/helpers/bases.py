"""A base to work out by hand."""

from drake_mobarm.robot.differential_drive import DifferentialDrive

# With its wheels 32 kg, and 1.08 kg m^2 about its axle's midpoint.
HAND_WORKED = DifferentialDrive(
    wheel_radius=0.1,
    track=0.4,
    mass=30.0,
    body_mass=20.0,
    com_offset=0.1,
    inertia=1.0,
    wheel_inertia=0.01,
)
