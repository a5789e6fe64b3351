"""The placement diagram: its plans, the robot on its stand, the command."""

import csv
import json

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_mobarm import cli, load_scenario, run
from drake_mobarm.diagrams.placement import PLAN_RATE, make_planner, make_plant
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.placement import ToolTarget
from drake_mobarm.robot.shape import HEIGHTS, RADIUS
from drake_mobarm.signals import BestStand
from drake_mobarm.world.obstacles import clearance, outlines
from drake_mobarm.world.sdf import load_world

OPEN = ["world=empty", "start=[0, 0, 0]", "grid=plain", "grid_size=0.2"]
HIGH = "target=[1, 0, 2.5]"


def open_floor(*overrides):
    return load_scenario("placement", [*OPEN, "target=[1, 0, 0.5]", *overrides])


def planner_of(scenario):
    target = ToolTarget(position=scenario.target, approach=scenario.approach)
    return make_planner(
        scenario, load_world(scenario.world), scenario.start, target
    )


def plan_while(target, seconds, *overrides):
    """What the planner tells at each of its updates, as a target moves."""
    builder = DiagramBuilder()
    planner = builder.AddSystem(planner_of(open_floor(*overrides)))
    source = builder.AddSystem(TrajectorySource(target))
    builder.Connect(source.get_output_port(), planner.get_input_port())
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = planner.GetMyContextFromRoot(simulator.get_context())
    told = []
    for step in range(1, round(seconds * PLAN_RATE) + 1):
        simulator.AdvanceTo(step / PLAN_RATE)
        told.append(
            (
                planner.GetOutputPort("placement").Eval(context),
                BestStand(planner.GetOutputPort("best_stand").Eval(context)),
                planner.GetOutputPort("planned").Eval(context)[0],
            )
        )
    return told


@pytest.fixture(scope="module")
def shipped():
    return run(load_scenario("placement", ["grid=plain", "grid_size=0.1"]))


def test_the_shipped_scenario_finds_a_stand(shipped):
    assert shipped.success
    assert "stand at" in shipped.reason


def test_the_plant_on_the_stand_has_its_tool_on_the_target(shipped):
    scenario = shipped.scenario
    plant = make_plant(scenario, SceneGraph())
    context = plant.CreateDefaultContext()
    stand = BestStand(shipped.outputs["best_stand"])
    base = plant.GetBodyByName("base")
    joints = {name: getattr(stand, f"{name}_q") for name in ARM_JOINTS}
    for name, angle in joints.items():
        plant.GetJointByName(name).set_angle(context, angle)
    tool = plant.GetFrameByName("tool").CalcPose(context, base.body_frame())
    c, s = np.cos(stand.yaw), np.sin(stand.yaw)
    R_WB = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    p_WT = R_WB @ tool.translation() + [stand.x, stand.y, 0]
    np.testing.assert_allclose(p_WT, scenario.target, atol=1e-6)
    a_W = R_WB @ tool.rotation().matrix()[:, 0]
    np.testing.assert_allclose(a_W, scenario.approach, atol=1e-6)


def test_the_robot_fits_where_it_is_to_stand(shipped):
    world = load_world(shipped.scenario.world)
    place = np.array(
        [shipped.metrics["stand_x_m"], shipped.metrics["stand_y_m"]]
    )
    assert clearance(outlines(world.obstacles, *HEIGHTS), place) > RADIUS


def test_the_stand_is_no_worse_than_the_best_square(shipped):
    metrics = shipped.metrics
    assert metrics["attractive_squares"] > 0
    assert metrics["objective"] <= metrics["best_square_objective"]
    placement = shipped.outputs["placement"]
    assert (np.diff(placement.objective) >= 0).all()
    assert placement.objective[0] == metrics["best_square_objective"]
    reach = np.hypot(*(placement.centres - shipped.scenario.target[:2]).T)
    assert reach.max() < 0.67


def test_a_target_out_of_reach_is_told_plainly():
    result = run(open_floor(HIGH))
    assert not result.success
    assert "not reachable" in result.reason
    assert "above the shoulder" in result.reason
    assert result.outputs["placement"].stand is None
    assert np.isnan(result.metrics["objective"])
    assert json.loads(result.summary())["metrics"]["objective"] is None


def test_nothing_is_planned_before_the_target_is_known():
    unknown = PiecewisePolynomial.ZeroOrderHold(
        [0.0, 1.05, 2.0], np.array([[np.nan, 1, 1], [np.nan, 0, 0], [0, 1, 1]])
    )
    told = plan_while(unknown, 1.5)
    planned = [planned for _, _, planned in told]
    assert planned == [0.0] * 11 + [1.0] * 4
    assert told[0][1].known == 0
    assert np.isnan(told[0][1].x)
    assert told[-1][1].known == 1


def test_a_new_plan_is_made_only_when_the_target_has_moved_far_enough():
    # 1 cm a step from x = 1: past the threshold of 4.5 cm at every fifth.
    moving = PiecewisePolynomial.FirstOrderHold(
        [0.0, 2.0], np.array([[1.0, 1.2], [0, 0], [1, 1]])
    )
    told = plan_while(moving, 1.6, "replan_distance=0.045")
    places = [placement.target.p_WT[0] for placement, _, _ in told]
    np.testing.assert_allclose(
        places, np.repeat([1.0, 1.05, 1.1, 1.15], 5)[:16] + 0.0005, atol=1e-9
    )
    # On open floor one target is as good as another.
    values = [stand.objective for _, stand, _ in told]
    np.testing.assert_allclose(values, values[0], rtol=0.01)


def test_a_lost_estimate_keeps_the_plan():
    lost = PiecewisePolynomial.ZeroOrderHold(
        [0.0, 0.55, 1.0], np.array([[1, np.nan, 0], [0, np.nan, 0], [1, 0, 0]])
    )
    told = plan_while(lost, 1.0)
    assert [planned for _, _, planned in told] == [1.0] * 10
    assert told[-1][1].x == told[0][1].x


def test_a_target_that_is_not_known_is_not_planned_for():
    # As a broken source might have it: a place, and not known.
    guess = PiecewisePolynomial.ZeroOrderHold(
        [0.0, 1.0], np.array([[1, 1], [0, 0], [0, 0]])
    )
    told = plan_while(guess, 0.5)
    assert all(planned == 0 for _, _, planned in told)


def test_the_robot_stands_beside_a_low_target_unless_it_does_not_look():
    low = "target=[1, 0, 0.25]"
    looks, blind = (
        run(open_floor(low, f"avoid_collisions={x}")) for x in ("true", "false")
    )
    for result, least in ((looks, 0.27), (blind, 0.0)):
        assert result.success
        place = [result.metrics["stand_x_m"], result.metrics["stand_y_m"]]
        distance = np.hypot(place[0] - 1, place[1])
        assert distance > least
        assert (distance < 0.27) == (result is blind)
    assert blind.metrics["objective"] < looks.metrics["objective"]


def test_links_that_keep_the_robot_from_a_better_stand_are_named():
    # Slantwise at a low target the hand would meet the chassis.
    result = run(open_floor("target=[1, 0, 0.2]", "approach=[0.6, 0, -0.8]"))
    stand = result.outputs["placement"].stand
    assert any("the arm would touch" in line for line in stand.active)


def test_what_the_motors_cannot_hold_is_no_stand():
    light = run(open_floor("objective.payload=0.25"))
    assert light.success
    assert 0 < light.metrics["largest_load"] <= 1
    heavy = run(open_floor("objective.payload=30"))
    assert not heavy.success
    assert "torque" in heavy.reason


def test_a_given_heading_is_kept():
    result = run(open_floor("heading=[0.7]"))
    assert result.metrics["stand_yaw_rad"] == pytest.approx(0.7)


def test_the_command_writes_map_squares_and_summary(tmp_path, capsys):
    out = tmp_path / "run"
    overrides = [x for pair in (("--set", o) for o in OPEN) for x in pair]
    code = cli.main(
        [
            *["run", "placement", "--out", str(out), *overrides],
            *["--set", "target=[1, 0, 0.5]", "--set", "approach=[0, 0, -1]"],
        ]
    )
    assert code == 0
    assert {f.name for f in out.iterdir()} == {
        *("recording.html", "summary.json", "scenario.yaml", "trace.npz"),
        *("diagram.dot", "map.png", "squares.csv"),
    }
    summary = json.loads((out / "summary.json").read_text())
    with (out / "squares.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == summary["metrics"]["attractive_squares"]
    assert float(rows[0]["objective"]) == pytest.approx(
        summary["metrics"]["best_square_objective"], abs=1e-6
    )
    printed = capsys.readouterr().out
    assert "stand at" in printed
    assert printed.splitlines()[-1] == f"open {out / 'recording.html'}"


def test_the_command_says_what_is_not_reachable(tmp_path, capsys):
    overrides = [x for pair in (("--set", o) for o in OPEN) for x in pair]
    code = cli.main(
        [
            *["run", "placement", "--no-html", "--out", str(tmp_path / "r")],
            *[*overrides, "--set", HIGH],
        ]
    )
    assert code == 1
    assert "not reachable" in capsys.readouterr().out
    assert (tmp_path / "r" / "map.png").stat().st_size > 10_000
