"""A user's own block in the place of a shipped one, and how it is checked."""

import json

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_mobarm import (
    ToolTarget,
    build_station,
    load_scenario,
    load_world,
    run,
)
from drake_mobarm.diagrams.homing import HOMING_BLOCKS, build_job
from drake_mobarm.diagrams.placement import make_planner
from drake_mobarm.diagrams.station import STATION_BLOCKS
from drake_mobarm.diagrams.wiring import Wiring
from drake_mobarm.exceptions import (
    BlockError,
    MobarmError,
    ParameterError,
    ScenarioError,
)
from drake_mobarm.sensors import (
    BEACONS,
)
from drake_mobarm.station import StationParameters

OPEN = ["world=empty", "avoidance=none", "start=[0, 0, 0]", "beacon=[2, 1]"]
PLACEMENT = ["world=empty", "start=[0, 0, 0]", "target=[1, 0, 0.5]"]
PLACEMENT += ["approach=[0, 0, -1]", "grid=plain", "grid_size=0.2"]


class Oracle(LeafSystem):
    """Knows where the beacon is, and arrives within 0.3 m of it."""

    def __init__(self, target=(2.0, 1.0)):
        super().__init__()
        self._known = np.array(target)
        self._pose = self.DeclareVectorInputPort("measured_base_pose", 3)
        self.DeclareVectorOutputPort("estimated_target", 3, self._tell)
        self.DeclareVectorOutputPort("arrived", 1, self._arrive)

    def _tell(self, context, output):
        output.SetFromVector([*self._known, 1.0])

    def _arrive(self, context, output):
        p_WB = self._pose.Eval(context)[:2]
        output.SetFromVector([float(np.hypot(*(p_WB - self._known)) < 0.3)])


class Ports(LeafSystem):
    """Has the ports that it is told, and does nothing."""

    def __init__(self, inputs=None, outputs=None):
        super().__init__()
        for name, size in (inputs or {}).items():
            if size is None:
                self.DeclareAbstractInputPort(name, AbstractValue.Make(""))
            else:
                self.DeclareVectorInputPort(name, size)
        for name, size in (outputs or {}).items():
            if size is None:
                self.DeclareAbstractOutputPort(
                    name, lambda: AbstractValue.Make(""), lambda c, o: None
                )
            else:
                self.DeclareVectorOutputPort(name, size, lambda c, o: None)


def test_with_a_swapped_estimator_all_of_a_run_is_there(tmp_path):
    scenario = load_scenario("homing", OPEN)
    result = run(scenario, seed=3, blocks={"estimator": Oracle()}, record=True)
    assert result.success
    assert result.reason == "arrived at the beacon"
    # It is the oracle that was believed.
    assert result.metrics["goal_position_error_m"] == 0
    estimates = result.trace["estimated_target"]
    np.testing.assert_array_equal(
        estimates, np.tile([2.0, 1.0, 1.0], (len(estimates), 1))
    )
    shown = result.save(tmp_path / "run")
    assert shown.name == "recording.html"
    assert {file.name for file in (tmp_path / "run").iterdir()} == {
        "diagram.dot",
        "recording.html",
        "scenario.yaml",
        "summary.json",
        "trace.npz",
        "trajectory.png",
    }
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["success"] is True
    assert "Oracle" in (tmp_path / "run" / "diagram.dot").read_text()


def test_a_block_may_read_any_signal_of_its_diagram():
    class Looker(Oracle):
        """Also reads what no shipped estimator does."""

        def __init__(self):
            super().__init__()
            self.seen = []
            self._ranges = self.DeclareVectorInputPort("lidar_ranges", 360)
            self.DeclarePerStepPublishEvent(
                lambda context: self.seen.append(
                    self._ranges.Eval(context).copy()
                )
            )

    looker = Looker()
    scenario = load_scenario("homing", [*OPEN, "time_limit=0.3"])
    run(scenario, blocks={"estimator": looker})
    assert looker.seen[-1].shape == (360,)
    assert (looker.seen[-1] == 12.0).all()  # An empty world's.


def test_a_block_of_the_station_is_exchanged_in_a_jobs_run():
    class Deaf(LeafSystem):
        """An antenna that hears nothing."""

        def __init__(self):
            super().__init__()
            self.DeclareVectorOutputPort(
                "beacon_reading",
                3,
                lambda c, o: o.SetFromVector([np.nan, np.nan, 0.0]),
            )

    scenario = load_scenario("homing", [*OPEN, "time_limit=1"])
    result = run(scenario, blocks={"beacon": Deaf()})
    assert not result.success
    assert (result.trace["estimated_target"][:, 2] == 0).all()


def test_a_planner_of_ones_own_takes_the_place_of_the_shipped_one():
    scenario = load_scenario("placement", PLACEMENT)
    # Its target is lower than the scenario's, which only the planner knows.
    planner = make_planner(
        scenario,
        load_world("empty"),
        scenario.start,
        ToolTarget(position=[1, 0, 0.4], approach=[0, 0, -1]),
    )
    result = run(scenario, blocks={"planner": planner})
    assert result.success
    assert result.outputs["placement"].target.p_WT[2] == 0.4


@pytest.mark.parametrize(
    ("name", "ports", "words"),
    [
        (
            "estimator",
            {"outputs": {"estimated_target": 3}},
            [
                "block 'estimator' (Ports) has no output port 'arrived'",
                "arrived (1)",
                "estimated_target (3)",
            ],
        ),
        (
            "estimator",
            {"outputs": {"estimated_target": 2, "arrived": 1}},
            ["output port estimated_target (2)", "estimated_target (3)"],
        ),
        (
            "estimator",
            {"outputs": {"estimated_target": None, "arrived": 1}},
            ["output port estimated_target (abstract)"],
        ),
        (
            "controller",
            {
                "inputs": {"wishes": 2},
                "outputs": {"commanded_base_velocity": 2},
            },
            [
                "block 'controller' (Ports) has input port wishes (2)",
                "waypoint (3)",
                "measured_base_pose (3)",
                "lidar_ranges (360)",
            ],
        ),
        (
            "avoidance",
            {"inputs": {"lidar_ranges": 90}, "outputs": {"waypoint": 3}},
            ["lidar_ranges (90)", "lidar_ranges (360)"],
        ),
        ("lidar", {"outputs": {"lidar_ranges": 90}}, ["lidar_ranges (360)"]),
        ("arm_driver", {"outputs": {}}, ["no output port 'arm_torque'"]),
        (
            "navigator",
            {},
            ["unknown block 'navigator'", "estimator", "arm_driver"],
        ),
        ("job", {}, ["unknown block 'job'"]),
    ],
)
def test_a_block_that_does_not_fit_is_one_line_that_says_what_does(
    name, ports, words
):
    scenario = load_scenario("homing", OPEN)
    with pytest.raises(BlockError) as caught:
        run(scenario, blocks={name: Ports(**ports)})
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message
    assert isinstance(caught.value, MobarmError)
    assert isinstance(caught.value, ValueError)


def test_what_a_block_tells_besides_is_not_read_by_others():
    class Bossy(Oracle):
        """Would also like to drive."""

        def __init__(self):
            super().__init__()
            self.DeclareVectorOutputPort(
                "commanded_base_velocity",
                2,
                lambda c, o: o.SetFromVector([-1.0, 0.0]),
            )

    scenario = load_scenario("homing", [*OPEN, "time_limit=1"])
    plain, bossy = (
        run(scenario, blocks={"estimator": block()}).trace["ground_truth"]
        for block in (Oracle, Bossy)
    )
    np.testing.assert_array_equal(plain, bossy)


def test_two_outputs_of_one_name_are_refused():
    wiring = Wiring()
    wiring.add("one", lambda: Ports(outputs={"a": 1}))
    with pytest.raises(BlockError, match="two outputs are named 'a'"):
        wiring.add("two", lambda: Ports(outputs={"a": 1}))


@pytest.mark.parametrize(
    ("world", "start", "word"),
    [
        ("empty", [0, 0, 0], "world"),
        (load_world("empty"), [0, 0], "start"),
        (load_world("empty"), [0, 0, np.nan], "start"),
    ],
)
def test_a_station_is_not_built_from_nonsense(world, start, word):
    with pytest.raises(ParameterError, match=f"^{word} is"):
        build_station(world, start, StationParameters())


def test_a_block_of_an_earlier_run_is_refused():
    scenario = load_scenario("homing", [*OPEN, "time_limit=0.1"])
    used = Oracle()
    run(scenario, blocks={"estimator": used})
    with pytest.raises(BlockError, match="part of another diagram"):
        run(scenario, blocks={"estimator": used})


@pytest.mark.parametrize("block", [Oracle, None, "Oracle"])
def test_a_block_that_is_no_system_is_refused(block):
    with pytest.raises(BlockError, match="has to be a System"):
        run(load_scenario("homing", OPEN), blocks={"estimator": block})


@pytest.mark.parametrize("scenario", ["homing", None, {"diagram": "homing"}])
def test_what_is_no_scenario_is_not_run(scenario):
    with pytest.raises(ScenarioError, match="load_scenario"):
        run(scenario)


@pytest.mark.parametrize("seed", [-1, 2**63, "1", 0.5, True])
def test_a_seed_that_is_no_whole_number_is_refused(seed):
    with pytest.raises(ParameterError, match="seed"):
        run(load_scenario("homing", OPEN), seed)


def test_every_named_block_can_be_exchanged():
    scenario = load_scenario("homing", OPEN)
    for name in (*HOMING_BLOCKS, *STATION_BLOCKS):
        # Known, but without the ports that are needed of it.
        with pytest.raises(BlockError, match=f"block '{name}'.* has no output"):
            run(scenario, blocks={name: Ports()})


def test_a_job_is_a_block_of_another_diagram():
    builder = DiagramBuilder()
    parameters = load_scenario("homing", ["avoidance=rules"])
    homing = builder.AddSystem(
        build_job(
            parameters,
            calibration=BEACONS["beacon_1"],
            station=StationParameters(),
        )
    )
    inputs = [
        homing.get_input_port(i).get_name()
        for i in range(homing.num_input_ports())
    ]
    assert sorted(inputs) == [
        "beacon_reading",
        "lidar_ranges",
        "measured_base_pose",
        "measured_base_velocity",
    ]
    for name in inputs:
        builder.ExportInput(homing.GetInputPort(name), name)
    for name in ("estimated_target", "waypoint", "commanded_base_velocity"):
        builder.ExportOutput(homing.GetOutputPort(name), name)
    diagram = builder.Build()
    assert diagram.GetOutputPort("commanded_base_velocity").size() == 2


def test_a_station_without_a_beacon_reads_none():
    station = build_station(load_world("empty"), [0, 0, 0], StationParameters())
    assert not station.HasOutputPort("beacon_reading")
    assert not station.HasSubsystemNamed("beacon_noise")
    assert station.HasOutputPort("lidar_ranges")


def test_an_input_reads_the_signal_of_its_name():
    wiring = Wiring()
    wiring.add("source", lambda: Ports(outputs={"a": 1, "b": 2}))
    wiring.add("sink", lambda: Ports(inputs={"b": 2, "c": 3}))
    diagram = wiring.build("pair", inputs={"c": 3, "d": 4})
    assert diagram.num_input_ports() == 1
    assert diagram.get_input_port().get_name() == "c"
    links = {
        (sink[0].get_name(), source[0].get_name())
        for sink, source in diagram.connection_map().items()
    }
    assert links == {("sink", "source")}


def test_a_signal_that_nothing_gives_is_named():
    wiring = Wiring()
    wiring.add("source", lambda: Ports(outputs={"a": 1}))
    for use in (wiring.log, wiring.export, wiring.signal):
        with pytest.raises(BlockError, match=r"no output gives 'b'.* a$"):
            use("b")


def test_two_readers_share_one_input_of_the_diagram():
    wiring = Wiring()
    for name in ("one", "two"):
        wiring.add(name, lambda: Ports(inputs={"c": 3}))
    diagram = wiring.build("readers", inputs={"c": 3})
    assert diagram.num_input_ports() == 1
