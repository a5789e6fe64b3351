"""What tests of the robot share."""

import pytest

from helpers.urdf import Robot


@pytest.fixture(scope="session")
def robot():
    return Robot()
