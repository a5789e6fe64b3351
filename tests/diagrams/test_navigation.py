"""Navigation in whole: planners, targets, floor plans, blocks and verdicts."""

import itertools

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from drake_mobarm import load_scenario, run
from drake_mobarm.diagrams.navigation import (
    NAVIGATION_BLOCKS,
    build_job,
)
from drake_mobarm.exceptions import BlockError
from drake_mobarm.navigation.job import PLANNERS
from drake_mobarm.runtime.simulation import build_diagram
from drake_mobarm.sensors.rssi import BEACONS
from helpers.reach import update_times

OPEN = ["world=empty", "start=[0, 0, 0]", "target=[2, 1]", "time_limit=12"]
KNOWN = "target_from=known"


def in_the_open(*overrides):
    return load_scenario("navigation", [*OPEN, *overrides])


def block(diagram, name):
    return diagram.GetSubsystemByName("job").GetSubsystemByName(name)


# Planners and targets


def test_the_shipped_scenario_runs_for_a_blink():
    result = run(load_scenario("navigation", ["time_limit=0.5"]))
    assert result.simulated_s == pytest.approx(0.5)
    assert not result.success
    assert "time limit" in result.reason


@pytest.mark.parametrize("planner", PLANNERS)
def test_each_planner_reaches_a_known_target(planner):
    result = run(in_the_open(f"planner={planner}", KNOWN), seed=1)
    assert result.success
    assert result.reason == "arrived at the target"
    metrics = result.metrics
    # Within 0.3 m, or 0.4 m by its attraction, and 3 cm of slowing down.
    limit = 0.33 if planner == "ours" else 0.43
    assert metrics["final_position_error_m"] < limit
    assert metrics["contacts"] == 0
    # It is the true position that is judged.
    end = result.trace["ground_truth"][-1, :2]
    assert metrics["final_position_error_m"] == pytest.approx(
        np.hypot(*(end - [2, 1]))
    )


@pytest.mark.parametrize("planner", PLANNERS)
def test_each_planner_reaches_a_beacon(planner):
    result = run(in_the_open(f"planner={planner}", "noise=1"), seed=1)
    assert result.success
    assert result.metrics["final_position_error_m"] < 0.6
    estimates = result.trace["estimated_target"]
    known = estimates[:, 2] > 0.5
    assert not known[0]
    # It is found: nobody tells where it is.
    assert np.ptp(estimates[known, 0]) > 0.01


def test_a_known_target_is_known_from_the_start():
    result = run(in_the_open(KNOWN, "time_limit=0.3"))
    np.testing.assert_array_equal(
        result.trace["estimated_target"],
        np.tile([2.0, 1.0, 1.0], (len(result.trace["t"]), 1)),
    )


def test_only_fields_have_forces():
    for planner in PLANNERS:
        result = run(in_the_open(f"planner={planner}", KNOWN, "time_limit=0.3"))
        forces = result.trace["navigation_forces"][-1]
        assert forces.any() == (planner != "ours")


def test_a_silent_beacon_leaves_the_robot_where_it_is_and_is_told():
    result = run(
        in_the_open("station.beacon.outages=[[0, 100]]", "time_limit=2")
    )
    assert not result.success
    assert "the target was never known" in result.reason
    assert result.metrics["distance_travelled_m"] < 0.01


# Seeds and blocks


@pytest.mark.parametrize("planner", ["ours", "apf_hw"])
def test_the_same_seed_gives_the_same_trace_to_the_bit(planner):
    scenario = in_the_open(f"planner={planner}", "time_limit=2")
    first, second = (run(scenario, seed=7) for _ in range(2))
    assert first.trace.keys() == second.trace.keys()
    for name, values in first.trace.items():
        np.testing.assert_array_equal(values, second.trace[name], name)
    assert first.metrics == second.metrics


def test_another_seed_gives_another_trace():
    scenario = in_the_open("time_limit=2")
    first, second = (run(scenario, seed=seed) for seed in (7, 8))
    apart = first.trace["estimated_target"] - second.trace["estimated_target"]
    assert np.nanmax(np.abs(apart)) > 1e-3


def test_recording_does_not_change_the_trace():
    scenario = in_the_open("planner=apf_hw", "time_limit=1")
    plain, recorded = run(scenario), run(scenario, record=True)
    for name, values in plain.trace.items():
        np.testing.assert_array_equal(values, recorded.trace[name], name)
    assert plain.recording is None
    assert "meshcat" in recorded.recording.lower()


class Straight(LeafSystem):
    """Drives forwards, and says that it is there after two seconds."""

    def __init__(self):
        super().__init__()
        outputs = {
            "commanded_base_velocity": lambda time: [0.5, 0.0],
            "arrived": lambda time: [float(time > 2.0)],
            "given_up": lambda time: [0.0] * 3,
            "navigation_forces": lambda time: [0.0] * 6,
        }
        for name, told in outputs.items():
            self.DeclareVectorOutputPort(
                name,
                len(told(0.0)),
                lambda context, output, told=told: output.SetFromVector(
                    told(context.get_time())
                ),
            )
        self.DeclareAbstractOutputPort(
            "planned_paths", lambda: Value(()), lambda context, output: None
        )


def test_a_planner_of_ones_own_takes_the_place_of_the_shipped_one():
    result = run(in_the_open(), blocks={"planner": Straight()})
    assert result.simulated_s == pytest.approx(2.0, abs=0.06)
    # A metre straight on; it was told to be there.
    x, y = result.trace["ground_truth"][-1, :2]
    assert x == pytest.approx(1.0, abs=0.2)
    assert y == pytest.approx(0.0, abs=0.02)
    assert "stopped 1." in result.reason


class Constant(LeafSystem):
    """Says that the target is at (1, -1.5)."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort(
            "estimated_target",
            3,
            lambda context, output: output.SetFromVector([1.0, -1.5, 1.0]),
        )


def test_an_estimator_of_ones_own_is_believed():
    result = run(in_the_open(), blocks={"estimator": Constant()})
    end = result.trace["ground_truth"][-1, :2]
    assert np.hypot(*(end - [1.0, -1.5])) < 0.4
    assert not result.success
    assert "the target's estimate" in result.reason


def test_blocks_that_are_not_there_are_named():
    for overrides, name in (
        ([KNOWN], "estimator"),
        (["pose=odometry"], "localizer"),
    ):
        with pytest.raises(BlockError, match=f"unknown block '{name}'") as e:
            run(in_the_open(*overrides), blocks={name: Constant()})
        assert "\n" not in str(e.value)


def test_every_named_block_can_be_exchanged():
    for name in NAVIGATION_BLOCKS:
        # Known, but without the ports that are needed of it.
        with pytest.raises(BlockError, match=f"block '{name}'.* has no output"):
            run(in_the_open(), blocks={name: ConstantVectorSource([0.0])})


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize(
    ("target", "pose"), [("known", "odometry"), ("beacon", "corrected")]
)
def test_only_the_trace_reads_the_ground_truth(planner, target, pose):
    diagram = build_diagram(
        in_the_open(
            f"planner={planner}", f"target_from={target}", f"pose={pose}"
        )
    )
    readers = [
        system.get_name()
        for (system, _), (source, port) in diagram.connection_map().items()
        if source.get_output_port(port).get_name() == "ground_truth"
    ]
    assert readers == ["trace.ground_truth"]


def test_the_job_alone_has_the_ports_that_it_is_documented_with():
    ports = {}
    for pose, calibration in itertools.product(
        ("odometry", "corrected"), (None, BEACONS["beacon_1"])
    ):
        scenario = in_the_open(f"pose={pose}")
        job = build_job(
            scenario,
            station=scenario.station,
            plan=None,
            calibration=calibration,
        )
        count = job.num_input_ports()
        ports[pose, calibration is not None] = (
            {job.get_input_port(i).get_name() for i in range(count)},
            {
                job.get_output_port(i).get_name()
                for i in range(job.num_output_ports())
            },
        )
    always = {
        "commanded_base_velocity",
        "arrived",
        "given_up",
        "navigation_forces",
        "planned_paths",
    }
    corrected = {"measured_base_pose", "pose_covariance"}
    assert ports == {
        ("odometry", False): (
            {"lidar_ranges", "measured_base_pose", "estimated_target"},
            always,
        ),
        ("odometry", True): (
            {"lidar_ranges", "measured_base_pose", "beacon_reading"},
            always | {"estimated_target"},
        ),
        ("corrected", False): (
            {"lidar_ranges", "odometry_pose", "estimated_target"},
            always | corrected,
        ),
        ("corrected", True): (
            {"lidar_ranges", "odometry_pose", "beacon_reading"},
            always | corrected | {"estimated_target"},
        ),
    }


def test_the_planner_works_5_ms_after_each_scan():
    times = update_times(block(build_diagram(in_the_open(KNOWN)), "planner"))
    # The simulation itself begins at 0 and ends at 0.25 s.
    np.testing.assert_allclose(times, [0, 0.005, 0.105, 0.205, 0.25])


def test_the_trace_holds_what_reports_and_tables_need():
    always = {
        "t",
        "ground_truth",
        "measured_base_pose",
        "estimated_target",
        "navigation_forces",
        "commanded_base_velocity",
    }
    for pose, more in (
        ("odometry", set()),
        ("corrected", {"odometry_pose", "pose_covariance"}),
    ):
        result = run(in_the_open(f"pose={pose}", "time_limit=0.1"))
        assert set(result.trace) == always | more
