from .arm_drive import ArmDriveParameters as ArmDriveParameters
from .base_drive import BaseDriveParameters as BaseDriveParameters
from .ground_truth import BaseTruth as BaseTruth
from .ground_truth import GroundTruthMonitor as GroundTruthMonitor
from .parameters import PROCESSING_DELAY as PROCESSING_DELAY
from .parameters import StationParameters as StationParameters
from .systems import ArmDriver as ArmDriver
from .systems import BaseDriver as BaseDriver
