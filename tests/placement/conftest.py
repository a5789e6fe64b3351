"""What tests of placement share."""

import pytest

from helpers.urdf import fixed_robot


@pytest.fixture(scope="session")
def plant():
    """The robot, its base at W's origin; set joints in a context of its own."""
    return fixed_robot()
