"""Homing in whole: runs that end well, their seeds, what noise does."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_mobarm import load_scenario, run
from drake_mobarm.homing.job import AVOIDANCES, ESTIMATORS
from drake_mobarm.robot.shape import ANTENNA_POSITION
from drake_mobarm.runtime.simulation import build_diagram
from drake_mobarm.sensors.beacon import Beacon
from drake_mobarm.sensors.systems import BeaconSensor
from helpers.reach import descriptions, differing, keys, reached, update_times

OPEN = ["world=empty", "avoidance=none", "start=[0, 0, 0]", "noise=3"]


def open_space(*overrides):
    return load_scenario("homing", [*OPEN, "beacon=[3, 2]", *overrides])


def test_the_shipped_scenario_runs_for_a_blink():
    result = run(load_scenario("homing", ["time_limit=0.5"]))
    assert result.simulated_s == pytest.approx(0.5)
    assert not result.success
    assert "time limit" in result.reason


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_robot_finds_a_beacon_in_open_space(estimator):
    result = run(open_space(f"estimator={estimator}"), seed=1)
    assert result.success
    metrics = result.metrics
    assert metrics["goal_position_error_m"] < 0.15
    assert metrics["final_position_error_m"] < 0.45
    assert metrics["path_efficiency"] > 0.95
    assert metrics["contacts"] == 0
    # It is the true position that is judged, and the clock that is read.
    end = result.trace["ground_truth"][-1, :2]
    assert metrics["final_position_error_m"] == pytest.approx(
        np.hypot(*(end - [3, 2]))
    )
    assert metrics["time_to_target_s"] == pytest.approx(result.simulated_s)


def test_the_same_seed_gives_the_same_trace_to_the_bit():
    first, second = (run(open_space(), seed=7) for _ in range(2))
    assert first.trace.keys() == second.trace.keys()
    for name, values in first.trace.items():
        np.testing.assert_array_equal(values, second.trace[name], name)
    assert first.metrics == second.metrics


def test_another_seed_gives_other_noise():
    first, second = (run(open_space(), seed=s) for s in (7, 8))
    readings = [r.trace["beacon_reading"][4:10, 0] for r in (first, second)]
    assert np.abs(readings[0] - readings[1]).max() > 1e-3


def test_recording_does_not_change_the_trace():
    scenario = open_space("time_limit=1")
    plain, recorded = run(scenario), run(scenario, record=True)
    for name, values in plain.trace.items():
        np.testing.assert_array_equal(values, recorded.trace[name], name)
    assert plain.recording is None
    assert "meshcat" in recorded.recording.lower()


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_ten_seconds_of_silence_do_not_stop_the_robot(estimator):
    scenario = open_space(
        f"estimator={estimator}", "station.beacon.outages=[[1, 11]]"
    )
    result = run(scenario, seed=2)
    assert result.success
    silent = (result.trace["t"] > 1.2) & (result.trace["t"] < 10.9)
    assert silent.any()
    assert (result.trace["beacon_reading"][silent, 2] == 0).all()
    held = result.trace["estimated_target"][silent]
    np.testing.assert_array_equal(held, np.tile(held[0], (len(held), 1)))


def test_a_silent_beacon_makes_the_robot_look_around_until_its_time_is_up():
    scenario = open_space("time_limit=3", "station.beacon.outages=[[0, 100]]")
    result = run(scenario)
    assert not result.success
    assert np.isnan(result.metrics["goal_position_error_m"])
    assert result.trace["ground_truth"][-1, 4] == pytest.approx(0.5, abs=0.05)
    assert '"goal_position_error_m": null' in result.summary()


HALF_TURN = "station.beacon.field_of_view=3.141592653589793"


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("noise", [1, 5])
def test_a_beacon_out_of_a_half_turns_view_is_found(estimator, noise):
    scenario = load_scenario(
        "homing",
        [
            *OPEN,
            "beacon=[-3, 1]",
            HALF_TURN,
            f"estimator={estimator}",
            f"noise={noise}",
        ],
    )
    result = run(scenario, seed=3)
    assert result.success
    assert result.metrics["final_position_error_m"] < 0.5
    heard = result.trace["beacon_reading"][:, 2] > 0.5
    assert not heard[:10].any()
    assert heard.any()


def test_an_antenna_that_hears_all_around_leaves_the_way_to_the_avoidance():
    diagram = build_diagram(load_scenario("homing", OPEN))
    lookout = block(diagram, "lookout")
    context = lookout.CreateDefaultContext()
    for name, value in {
        "measured_base_pose": [0, 0, 0],
        "beacon_reading": [np.nan, np.nan, 0],
        "estimated_target": [0.1, 0, 1],
        "lidar_ranges": np.full(360, 12.0),
        "avoidance_waypoint": [3, 4, 0.7],
    }.items():
        lookout.GetInputPort(name).FixValue(context, value)
    simulator = Simulator(lookout, context)
    simulator.AdvanceTo(2.0)
    found = lookout.GetOutputPort("waypoint").Eval(simulator.get_context())
    np.testing.assert_array_equal(found, [3, 4, 0.7])


class SendsNaN(BeaconSensor):
    """Reads the beacon, but tells NaN marked valid from 1 s to 3 s."""

    def _update(self, context, state):
        super()._update(context, state)
        if 1.0 <= context.get_time() < 3.0:
            state.set_value([np.nan, np.nan, 1.0])


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_sensor_that_sends_nan_does_not_poison_the_estimate(estimator):
    scenario = open_space(f"estimator={estimator}", "time_limit=20")
    beacon = Beacon(position=scenario.beacon, noise=scenario.noise)
    broken = SendsNaN(
        scenario.station.beacon, beacon, np.array(ANTENNA_POSITION)
    )
    result = run(scenario, seed=1, blocks={"beacon": broken})
    assert result.success
    readings = result.trace["beacon_reading"]
    assert (np.isnan(readings[:, 0]) & (readings[:, 2] == 1)).any()
    estimates = result.trace["estimated_target"]
    known = estimates[:, 2] > 0.5
    assert known.any()
    assert np.isfinite(estimates[known]).all()
    np.testing.assert_allclose(estimates[-1, :2], [3, 2], atol=0.15)


def block(diagram, name):
    return diagram.GetSubsystemByName("job").GetSubsystemByName(name)


def test_estimator_and_avoidance_are_swapped_behind_the_same_ports():
    diagrams = [
        build_diagram(
            load_scenario("homing", [f"estimator={e}", f"avoidance={a}"])
        )
        for e in ESTIMATORS
        for a in AVOIDANCES
    ]
    outputs = {
        (
            tuple(
                system.get_output_port(i).get_name()
                for i in range(system.num_output_ports())
            )
        )
        for diagram in diagrams
        for system in [block(diagram, "estimator")]
    }
    assert outputs == {("estimated_target", "arrived")}
    for diagram in diagrams:
        avoidance = block(diagram, "avoidance")
        assert avoidance.GetOutputPort("waypoint").size() == 3


def test_only_metrics_and_drawing_read_the_ground_truth():
    diagram = build_diagram(load_scenario("homing"))
    readers = []
    for (system, _), (source, port) in diagram.connection_map().items():
        if source.get_output_port(port).get_name() == "ground_truth":
            readers.append(system.get_name())
    assert readers == ["trace.ground_truth"]


# What each key, or what begins like it, is there for.
REACHES = {
    "estimator": {"estimator"},
    "avoidance": {"avoidance", "never_gives_up"},
    "map": {"avoidance"},
    "hybrid": {"estimator"},
    "filter": {"estimator"},
    "rules": {"avoidance"},
    "lookout": {"lookout"},
    "controller": {"controller"},
    "world": {"lidar"},  # And geometries, which are no system's parameters.
    "meshes": set(),  # The shipped worlds have none.
    "start": {"plant", "odometry"},
    "beacon": {"beacon"},
    "noise": {"beacon"},
    "calibration_noise": {"estimator"},
    "seed": {"estimator"},  # By the calibration; noise is in the context.
    "station.time_step": {"plant", "ground_truth"},
    "station.stowed": {"plant", "arm_driver", "stow"},
    "station.lidar.rays": {
        "lidar",
        "lidar_noise",
        "localization",
        "avoidance",
        "lookout",
    },
    "station.lidar.rate": {
        "lidar",
        "lidar_noise",
        "localization",
        "avoidance",
    },
    "station.lidar.range_max": {
        "lidar",
        "localization",
        "avoidance",
        "lookout",
    },
    "station.lidar.noise": {"lidar"},
    "station.beacon": {"beacon"},
    "station.beacon.field_of_view": {"beacon", "lookout"},
    "station.beacon.rate": {"beacon", "beacon_noise", "estimator", "lookout"},
    "station.beacon.model": {"beacon", "estimator"},
    "station.base_drive": {"base_driver"},
    "station.base_drive.speed_limit": {"base_driver", "controller"},
    "station.base_drive.base": {"base_driver", "odometry"},
    **{
        f"station.base_drive.base.{key}": {
            "base_driver",
            "odometry",
            "estimator",
        }
        for key in ("wheel_radius", "track", "wheel_speed_limit")
    },
    "station.arm_drive": {"arm_driver"},
    "station.odometry": {"odometry"},
    "station.localization": {"localization"},
    "station.scan_matching": {"localization"},
}


@pytest.mark.parametrize(
    "key",
    [
        key
        for key in keys(load_scenario("homing"))
        if key not in {"diagram", "time_limit"}
    ],
)
def test_a_key_reaches_the_systems_that_it_is_for_and_no_other(key):
    starts = [start for start in REACHES if f"{key}.".startswith(f"{start}.")]
    part = key.split(".")[0]
    variant = {
        "hybrid": ["estimator=hybrid"],
        "rules": ["avoidance=rules"],
    }.get(part, [])
    assert reached("homing", key, *variant) == REACHES[max(starts, key=len)]


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_no_estimator_is_told_the_simulated_noise(estimator):
    assert reached("homing", "noise", f"estimator={estimator}") == {"beacon"}


def test_the_diagrams_seed_is_that_of_the_calibration():
    scenario = open_space()
    zero, one, other = (
        descriptions(build_diagram(scenario, seed=seed)) for seed in (0, 1, 2)
    )
    assert differing(zero, one) == differing(one, other) == {"estimator"}


@pytest.mark.parametrize(
    ("name", "period"), [("estimator", 0.05), ("avoidance", 0.1)]
)
def test_a_block_works_5_ms_after_each_sample_of_its_sensor(name, period):
    times = update_times(block(build_diagram(load_scenario("homing")), name))
    # The simulation itself begins at 0 and ends at 0.25 s.
    expected = [0, *np.arange(0.005, 0.25, period), 0.25]
    np.testing.assert_allclose(times, expected, atol=1e-12)


def test_the_trace_holds_what_reports_and_tables_need():
    assert set(run(open_space("time_limit=0.1")).trace) == {
        "t",
        "ground_truth",
        "measured_base_pose",
        "beacon_reading",
        "estimated_target",
        "waypoint",
        "commanded_base_velocity",
    }
