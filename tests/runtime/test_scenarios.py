"""Scenarios from YAML: what loads, and what is refused in one line."""

import dataclasses
import os

import pytest
import yaml

from drake_mobarm import load_scenario
from drake_mobarm.exceptions import (
    MobarmError,
    ParameterError,
    ScenarioError,
    WorldError,
)
from drake_mobarm.runtime.scenarios import (
    dump_scenario,
    job_of,
    scenario_names,
)
from drake_mobarm.runtime.typed_values import to_values

BOX_WITH_A_ROOM = """<?xml version="1.0"?>
<sdf version="1.9"><model name="hut"><static>true</static><link name="l">
{walls}
</link></model></sdf>
"""
WALL = """<collision name="{name}"><pose>{x} {y} 0.5 0 0 0</pose><geometry>
<box><size>{sx} {sy} 1</size></box></geometry></collision>"""


def write(folder, text, name="mine.yaml"):
    file = folder / name
    file.write_text(text)
    return str(file)


def test_every_shipped_scenario_loads():
    assert scenario_names() == ["homing", "navigation", "placement"]
    for name in scenario_names():
        assert load_scenario(name).diagram == name


def test_the_newcomer_sees_a_home_avoidance_and_the_worst_noise():
    scenario = load_scenario("homing")
    assert scenario.world == "small_house"
    assert scenario.avoidance == "map"
    assert scenario.noise == 5


def test_an_override_reaches_a_nested_value():
    scenario = load_scenario(
        "homing", ["station.lidar.rays=720", "hybrid.tau=3"]
    )
    assert scenario.station.lidar.rays == 720
    assert scenario.hybrid.tau == 3.0


def test_whole_numbers_and_exponents_are_numbers():
    scenario = load_scenario("homing", ["time_limit=6e1"])
    assert scenario.time_limit == 60.0
    assert load_scenario("homing", ["time_limit=60"]).time_limit == 60.0


def test_what_is_dumped_loads_as_the_same_scenario(tmp_path):
    scenario = load_scenario("homing", ["noise=2", "hybrid.tau=3.5"])
    file = write(tmp_path, dump_scenario(scenario))
    assert load_scenario(file) == scenario


@pytest.mark.parametrize("name", scenario_names())
def test_every_default_is_spelled_out_and_nothing_else(name, tmp_path):
    def check(part, values):
        assert set(values) == {field.name for field in dataclasses.fields(part)}
        for key, value in values.items():
            if dataclasses.is_dataclass(getattr(part, key)):
                check(getattr(part, key), value)
            else:
                assert value == to_values(getattr(part, key))

    scenario = load_scenario(name)
    text = dump_scenario(scenario)
    check(scenario, yaml.safe_load(text))
    assert load_scenario(write(tmp_path, text)) == scenario


def test_an_edited_diagram_of_ones_own_is_loaded_anew(tmp_path):
    scenario = write(tmp_path, "diagram: mine.py\n")
    file = tmp_path / "mine.py"
    for edition in (1, 2):
        file.write_text(f"EDITION = {edition}\ndef build(): ...\n")
        # An hour later: Python's own cache counts whole seconds.
        os.utime(file, (3600 * edition, 3600 * edition))
        job = job_of(load_scenario(scenario))
        assert edition == job.module.EDITION


@pytest.mark.parametrize(
    ("override", "error", "names"),
    [
        ("wrld=empty", ScenarioError, ["wrld", "world"]),
        ("station.lidr.rays=3", ScenarioError, ["lidr", "station.lidar"]),
        ("noise=6", ParameterError, ["noise", "6", "1, 2, 3, 4, 5"]),
        ("noise=two", ScenarioError, ["noise", "two", "int"]),
        ("noise=true", ScenarioError, ["noise", "int"]),
        ("start=here", ScenarioError, ["start", "list"]),
        ("start=[0, 0]", ParameterError, ["start", "yaw"]),
        ("start=[.nan, 0, 0]", ScenarioError, ["start[0]", "nan"]),
        ("beacon=[.inf, 0]", ScenarioError, ["beacon[0]", "inf"]),
        ("time_limit=-1", ParameterError, ["time_limit", "-1"]),
        ("seed=-1", ParameterError, ["seed", "-1", "0 or more"]),
        (f"seed={2**63}", ParameterError, ["seed", "below 2**63"]),
        ("seed=1.5", ScenarioError, ["seed", "1.5", "int"]),
        ("time_limit=.inf", ScenarioError, ["time_limit", "inf"]),
        ("estimator=guess", ParameterError, ["guess", "hybrid", "filter"]),
        ("avoidance=luck", ParameterError, ["luck", "none", "rules"]),
        ("diagram=dancing", ScenarioError, ["dancing", "homing"]),
        ("world=mars", WorldError, ["mars", "small_house", "empty"]),
        ("start=[-6.0, 2.0, 0]", ScenarioError, ["start", "inside"]),
        ("start=[30, 0, 0]", ScenarioError, ["start", "outside"]),
        ("beacon=[30, 0]", ScenarioError, ["beacon", "outside"]),
        ("beacon=[-6.0, 2.0]", ScenarioError, ["beacon", "inside"]),
        ("hybrid.tau=0", ParameterError, ["hybrid.tau", "0"]),
        ("station.lidar.rays=1.5", ScenarioError, ["lidar.rays", "int"]),
        ("station.beacon.model=b", ParameterError, ["model", "beacon_1"]),
        ("hybrid=3", ScenarioError, ["hybrid"]),
        ("noise", ScenarioError, ["noise", "key.path=value"]),
        ("noise=[", ScenarioError, ["noise", "parse"]),
        ("hybrid={tau: 1, tau: 2}", ScenarioError, ["hybrid", "parse"]),
        ("noise.a=3", ScenarioError, ["noise"]),
    ],
)
def test_bad_values_are_named(override, error, names):
    with pytest.raises(error) as caught:
        load_scenario("homing", [override])
    assert issubclass(error, MobarmError)
    message = str(caught.value)
    assert "\n" not in message
    for name in names:
        assert name in message


@pytest.mark.parametrize(
    ("override", "error", "names"),
    [
        ("approach=[0, 0, 2]", ParameterError, ["approach", "unit vector"]),
        (
            "approach=[3, 0, -4]",
            ParameterError,
            ["approach", "[0.6, 0.0, -0.8]"],
        ),
        ("approach=[0, 0, 0]", ParameterError, ["approach", "unit vector"]),
        ("approach=[0, 1]", ParameterError, ["approach", "three"]),
        ("approach=[.nan, 0, 1]", ScenarioError, ["approach[0]", "nan"]),
        ("target=[1, 2]", ParameterError, ["target", "three"]),
        ("target=[1, 2, -0.1]", ParameterError, ["target", "floor"]),
        ("target=[1, 2, .inf]", ScenarioError, ["target[2]", "inf"]),
        ("target=there", ScenarioError, ["target", "list"]),
        ("heading=[0, 1]", ParameterError, ["heading", "empty"]),
        ("grid=hexagons", ParameterError, ["hexagons", "optimised", "plain"]),
        ("seed=-1", ParameterError, ["seed", "-1", "0 or more"]),
        ("seed=x", ParameterError, ["seed", "x", "0 or more"]),
        ("grid_size=0", ParameterError, ["grid_size", "0.05"]),
        ("replan_distance=-1", ParameterError, ["replan_distance", "-1"]),
        ("start=[-6.0, 2.0, 0]", ScenarioError, ["start", "inside"]),
        ("beacon=[1, 2]", ScenarioError, ["beacon", "target"]),
        ("diagram=[placement]", ScenarioError, ["diagram", "homing"]),
        ("target=[1e200, 0, 0.5]", ParameterError, ["target", "1000 m"]),
        (
            "objective.torque_weight=1e-300",
            ParameterError,
            ["torque_weight", "1e-6 to 1e6"],
        ),
        (
            "objective.torque_shape=[4, 8.2, 8.2, 4.1, 4.1, 1.5]",
            ParameterError,
            ["torque_shape", "limit or more", "4.1"],
        ),
        (
            "objective.torque_shape=[9]",
            ParameterError,
            ["torque_shape", "6 numbers"],
        ),
        (
            "objective.torque_weight=-1",
            ParameterError,
            ["objective.torque_weight", "-1"],
        ),
    ],
)
def test_bad_values_of_a_placement_are_named(override, error, names):
    with pytest.raises(error) as caught:
        load_scenario("placement", [override])
    message = str(caught.value)
    assert "\n" not in message
    for name in names:
        assert name in message


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("start: [1, 2", ["parse"]),
        ("noise: 1\nnoise: 2\n", ["'noise'", "twice"]),
        ("hybrid: {tau: 1, tau: 2}\n", ["'tau'", "twice"]),
        ("- a\n- b\n", ["keys and values"]),
        ("", ["keys and values"]),
        ("world: empty\n", ["diagram is missing", "homing"]),
    ],
)
def test_a_file_that_is_no_scenario_is_refused(tmp_path, text, names):
    file = write(tmp_path, text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file)
    for name in [file, *names]:
        assert name in str(caught.value)


def test_an_unknown_scenario_lists_those_there_are():
    with pytest.raises(ScenarioError, match=r"nowhere.*homing"):
        load_scenario("nowhere")


def test_a_world_given_by_path_is_used(tmp_path):
    walls = [("n", 0, 3, 6, 0.1), ("s", 0, -3, 6, 0.1)]
    walls += [("e", 3, 0, 0.1, 6.1), ("w", -3, 0, 0.1, 6.1)]
    shapes = [
        WALL.format(name=n, x=x, y=y, sx=sx, sy=sy) for n, x, y, sx, sy in walls
    ]
    file = write(
        tmp_path, BOX_WITH_A_ROOM.format(walls="".join(shapes)), "hut.sdf"
    )
    places = [f"world={file}", "start=[0, 0, 0]", "beacon=[2, 1]"]
    assert load_scenario("homing", places).world == file
    with pytest.raises(ScenarioError, match="outside the walls of hut"):
        load_scenario("homing", [*places, "start=[5, 0, 0]"])
    # Without a wall there is no outside.
    file = write(tmp_path, BOX_WITH_A_ROOM.format(walls=shapes[0]), "fence.sdf")
    places = [f"world={file}", "start=[0, 5, 0]", "beacon=[2, 1]"]
    assert load_scenario("homing", places).start == (0.0, 5.0, 0.0)
