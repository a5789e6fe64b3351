"""The machine on paper: base and arm."""

from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.arm_parameters import (
    APPENDIX_C,
    WIDOWX_250,
    ArmParameters,
)

__all__ = ["APPENDIX_C", "WIDOWX_250", "ArmKinematics", "ArmParameters"]
