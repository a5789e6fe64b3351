from .arm_kinematics import ArmKinematics as ArmKinematics
from .arm_parameters import APPENDIX_C as APPENDIX_C
from .arm_parameters import WIDOWX_250 as WIDOWX_250
from .arm_parameters import ArmParameters as ArmParameters
from .differential_drive import DifferentialDrive as DifferentialDrive
