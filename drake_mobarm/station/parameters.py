"""How the station is simulated, sensed and driven."""

from dataclasses import field

from drake_mobarm.checks import finite_numbers, one_of, within
from drake_mobarm.frozen import frozen
from drake_mobarm.robot.shape import STOWED
from drake_mobarm.sensors.beacon import BeaconParameters
from drake_mobarm.sensors.lidar import LidarParameters
from drake_mobarm.sensors.odometry import OdometryParameters
from drake_mobarm.sensors.scan_matching import ScanMatchingParameters
from drake_mobarm.station.arm_drive import ArmDriveParameters
from drake_mobarm.station.base_drive import BaseDriveParameters

PROCESSING_DELAY = 0.005
"""How long after a sample a system should work on it [s].

Sensors sample at whole multiples of their periods from time 0, odometry at
every hundredth of a second. A reader that updates this much later sees a
sample together with the odometry of the same instant.
"""

LOCALIZATIONS = ("odometry", "scan_matching")


@frozen
class StationParameters:
    """How the station is simulated, sensed and driven.

    Attributes:
        time_step: of the plant [s].
        stowed: the arm's joints at the start [rad], (6,).
        lidar: the scanner.
        beacon: how the antenna array hears a beacon.
        base_drive: the base driver.
        arm_drive: the arm driver.
        odometry: what the wheels' odometry gets wrong, besides slip.
        localization: what the measured pose comes from: `odometry`, or
            `scan_matching`, which corrects odometry by the lidar.
        scan_matching: parameters of that.
    """

    time_step: float = 0.01
    stowed: tuple[float, ...] = STOWED
    lidar: LidarParameters = field(default_factory=LidarParameters)
    beacon: BeaconParameters = field(default_factory=BeaconParameters)
    base_drive: BaseDriveParameters = field(default_factory=BaseDriveParameters)
    arm_drive: ArmDriveParameters = field(default_factory=ArmDriveParameters)
    odometry: OdometryParameters = field(default_factory=OdometryParameters)
    localization: str = "scan_matching"
    scan_matching: ScanMatchingParameters = field(
        default_factory=ScanMatchingParameters
    )

    def __post_init__(self) -> None:
        within(self, "[1e-4, 0.01]", "time_step")
        one_of(self, LOCALIZATIONS, "localization")
        finite_numbers(
            self,
            "[waist, shoulder, elbow, forearm roll, wrist angle, wrist rotate]"
            " in rad",
            "stowed",
        )
