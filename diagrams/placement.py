"""Placement: the stand planner; with a target, and the robot on its stand."""

from collections.abc import Mapping, Sequence

from pydrake.geometry import Meshcat, SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, System
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from drake_mobarm.diagrams.wiring import NO_BLOCKS, Wiring
from drake_mobarm.placement.collision import Surroundings
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.grid import optimise_grid, plain_grid
from drake_mobarm.placement.job import PlacementParameters, PlacementScenario
from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.planner import PlannerParameters
from drake_mobarm.placement.problem import StandProblem, ToolTarget
from drake_mobarm.placement.systems import RobotPoser, StandPlanner
from drake_mobarm.placement.view import PlacementView
from drake_mobarm.robot.arm_kinematics import ArmKinematics
from drake_mobarm.robot.shape import HEIGHTS, RADIUS, URDF
from drake_mobarm.signals import sizes
from drake_mobarm.station.parameters import PROCESSING_DELAY
from drake_mobarm.station.plant import place_robot
from drake_mobarm.world.sdf import add_world, load_world
from drake_mobarm.world.world import World

PLACEMENT_BLOCKS = ("planner",)
"""The block that a user may exchange."""

PLAN_RATE = 10.0


def build_job(
    parameters: PlacementParameters,
    *,
    world: World,
    start: Sequence[float],
    target: ToolTarget,
    heading: float | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires placement without a target.

    Args:
        parameters: how a stand is chosen.
        world: the building.
        start: where the base is when it begins, [x, y, ...] in W [m].
        target: height and approach of the tool's target; its place on the
            floor plan, which has to be on the map, comes through the input.
        heading: of the base at the stand [rad]; None where it may choose.
        blocks: systems in the places of some of `PLACEMENT_BLOCKS`.

    Returns:
        A diagram with the input `estimated_target` (TargetEstimate) and the
        outputs `placement` (abstract, Placement), `best_stand` (BestStand)
        and `planned` (1).

    Raises:
        BlockError: a block's ports do not fit, or its name is unknown.
    """
    wiring = Wiring(blocks)
    wiring.add(
        "planner",
        lambda: make_planner(parameters, world, start, target, heading),
        {"placement": None, "planned": 1} | sizes("best_stand"),
    )
    wiring.export("placement", "best_stand", "planned")
    return wiring.build("placement", inputs=sizes("estimated_target"))


def build(
    scenario: PlacementScenario,
    *,
    seed: int = 0,
    meshcat: Meshcat | None = None,
    blocks: Mapping[str, System] = NO_BLOCKS,
) -> Diagram:
    """Wires placement with a target that stands still, logs and a view.

    Args:
        scenario: what to build.
        seed: of the run; nothing here is random.
        meshcat: where to draw the robot on its stand, if anywhere.
        blocks: systems in the places of some of `PLACEMENT_BLOCKS`.

    Returns:
        A diagram with the outputs `placement` (abstract, Placement),
        `best_stand` (BestStand) and `done` (1), which ends a run, and a
        VectorLogSink for each signal of its trace.

    Raises:
        BlockError: a block's ports do not fit, or its name is unknown.
    """
    wiring = Wiring()
    wiring.add_primitive(
        "target",
        ConstantVectorSource([*scenario.target[:2], 1.0]),
        "estimated_target",
    )
    wiring.add(
        "job",
        lambda: build_job(
            scenario,
            world=load_world(scenario.world, scenario.meshes),
            start=scenario.start,
            target=ToolTarget(
                position=scenario.target, approach=scenario.approach
            ),
            heading=scenario.heading[0] if scenario.heading else None,
            blocks=blocks,
        ),
    )
    wiring.export("placement", "best_stand", done="planned")
    wiring.log("estimated_target", "best_stand")
    if meshcat is not None:
        scene_graph = wiring.builder.AddNamedSystem("scene_graph", SceneGraph())
        plant = make_plant(scenario, scene_graph)
        wiring.add("poser", lambda: RobotPoser(plant))
        wiring.add_primitive(
            "poses",
            poses := MultibodyPositionToGeometryPose(plant),
            "geometry_poses",
            ["robot_positions"],
        )
        wiring.builder.Connect(
            poses.get_output_port(),
            scene_graph.get_source_pose_port(plant.get_source_id()),
        )
        wiring.offer("query_object", scene_graph.get_query_output_port())
        wiring.add(
            "view",
            lambda: PlacementView(meshcat, scenario.target, scenario.approach),
        )
        wiring.add_visualizer(meshcat)
    return wiring.build("placement")


def make_planner(
    parameters: PlacementParameters,
    world: World,
    start: Sequence[float],
    target: ToolTarget,
    heading: float | None = None,
) -> StandPlanner:
    """The planner, with the free space of a world; as `build_job` has it."""
    free = FreeSpace.of_world(
        world, start[:2], RADIUS, HEIGHTS, target.p_WT[:2]
    )
    collisions = parameters.avoid_collisions
    problem = StandProblem(
        objective=PlacementObjective(ArmKinematics(), parameters.objective),
        target=target,
        free=free,
        heading=heading,
        surroundings=Surroundings(world.obstacles) if collisions else None,
    )
    make_grid = optimise_grid if parameters.grid == "optimised" else plain_grid
    return StandPlanner(
        problem,
        make_grid(free, parameters.grid_size),
        PlannerParameters(
            replan_distance=parameters.replan_distance,
            rate=PLAN_RATE,
            delay=PROCESSING_DELAY,
        ),
    )


def make_plant(
    scenario: PlacementScenario, scene_graph: SceneGraph
) -> MultibodyPlant:
    """Robot and world, to be posed rather than simulated."""
    plant = MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    Parser(plant).AddModels(str(URDF))
    add_world(plant, load_world(scenario.world, scenario.meshes))
    plant.Finalize()
    place_robot(plant, scenario.start)
    return plant
