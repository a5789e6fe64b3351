"""Placement scenarios: where the start may be."""

import pytest

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import ScenarioError
from helpers.shapes import write_wall


def test_the_start_needs_the_robots_radius_and_the_target_none(tmp_path):
    # The wall's face is at 3 m, the radius is 0.27 m.
    target = "target=[3.5, 0, 2.1]"
    world = f"world={write_wall(tmp_path)}"
    load_scenario("placement", [world, target, "start=[2.72, 0, 0]"])
    for start in (2.74, 3.5):
        with pytest.raises(ScenarioError, match=r"^start"):
            load_scenario(
                "placement", [world, target, f"start=[{start}, 0, 0]"]
            )
