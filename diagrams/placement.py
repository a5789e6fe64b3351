"""Placement: a target, the stand planner, and the robot on its stand."""

from pydrake.geometry import Meshcat, SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from drake_mobarm.diagrams.station import PROCESSING_DELAY, place_robot
from drake_mobarm.drawing.stage import PlacementView, add_visualizer
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import optimise_grid, plain_grid
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.systems import RobotPoser, StandPlanner
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.runtime.scenarios import (
    ROBOT_HEIGHTS,
    ROBOT_RADIUS,
    PlacementScenario,
)
from drake_mobarm.world.sdf import MODELS, add_world, load_world

PLAN_RATE = 10.0
LOG_PERIOD = 0.05


def build(
    scenario: PlacementScenario,
    calibration_seed: int = 0,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Wires the placement diagram.

    Args:
        scenario: what to build.
        calibration_seed: of nothing here: no beacon is heard.
        meshcat: where to draw the robot on its stand, if anywhere.

    Returns:
        A diagram with the outputs `placement` (Placement), `best_stand`
        (BestStand) and `done` (1), which ends a run, and a VectorLogSink for
        each signal of its trace.
    """
    builder = DiagramBuilder()
    target = builder.AddNamedSystem(
        "target", ConstantVectorSource([*scenario.target[:2], 1.0])
    )
    planner = builder.AddNamedSystem("planner", make_planner(scenario))
    builder.Connect(
        target.get_output_port(), planner.GetInputPort("estimated_target")
    )
    builder.ExportOutput(planner.GetOutputPort("placement"), "placement")
    builder.ExportOutput(planner.GetOutputPort("best_stand"), "best_stand")
    builder.ExportOutput(planner.GetOutputPort("planned"), "done")
    for name, port in (
        ("estimated_target", target.get_output_port()),
        ("best_stand", planner.GetOutputPort("best_stand")),
    ):
        log = LogVectorOutput(port, builder, LOG_PERIOD)
        log.set_name(f"trace.{name}")

    if meshcat is not None:
        scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
        plant = make_plant(scenario, scene_graph)
        poser = builder.AddNamedSystem("poser", RobotPoser(plant))
        poses = builder.AddNamedSystem(
            "poses", MultibodyPositionToGeometryPose(plant)
        )
        view = builder.AddNamedSystem(
            "view",
            PlacementView(meshcat, scenario.target, scenario.approach),
        )
        builder.Connect(
            planner.GetOutputPort("best_stand"),
            poser.GetInputPort("best_stand"),
        )
        builder.Connect(
            poser.GetOutputPort("robot_positions"), poses.get_input_port()
        )
        builder.Connect(
            poses.get_output_port(),
            scene_graph.get_source_pose_port(plant.get_source_id()),
        )
        builder.Connect(
            planner.GetOutputPort("placement"), view.GetInputPort("placement")
        )
        add_visualizer(builder, scene_graph.get_query_output_port(), meshcat)
    diagram: Diagram = builder.Build()
    diagram.set_name("placement")
    return diagram


def make_planner(scenario: PlacementScenario) -> StandPlanner:
    """The planner, with the free space of the scenario's world."""
    world = load_world(scenario.world)
    free = FreeSpace.of_world(
        world,
        scenario.start[:2],
        ROBOT_RADIUS,
        ROBOT_HEIGHTS,
        scenario.target[:2],
    )
    make_grid = optimise_grid if scenario.grid == "optimised" else plain_grid
    return StandPlanner(
        PlacementObjective(ArmKinematics(), scenario.objective),
        scenario.target[2],
        scenario.approach,
        free,
        make_grid(free, scenario.grid_size),
        scenario.heading[0] if scenario.heading else None,
        Surroundings(world.obstacles) if scenario.avoid_collisions else None,
        scenario.replan_distance,
        PLAN_RATE,
        PROCESSING_DELAY,
    )


def make_plant(
    scenario: PlacementScenario, scene_graph: SceneGraph
) -> MultibodyPlant:
    """Robot and world, to be posed rather than simulated."""
    plant = MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModels(str(MODELS / "mobile_arm.urdf"))
    add_world(plant, load_world(scenario.world))
    plant.Finalize()
    place_robot(plant, scenario.start)
    return plant
