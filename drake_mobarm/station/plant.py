"""The robot in its world, as a MultibodyPlant with contact."""

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    CollisionFilterDeclaration,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    ContactResults,
    CoulombFriction,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.systems.framework import DiagramBuilder

from drake_mobarm.geometry import Array
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import ROLLING_BODIES, STOWED, URDF
from drake_mobarm.world.sdf import add_world
from drake_mobarm.world.world import FARTHEST, World

ROBOT = "mobile_arm"
"""The robot's model instance."""

# The ground reaches further than anything stands and a robot can drive in an
# hour; its depth is of no account [m].
_GROUND_REACH = 1.5 * FARTHEST
_GROUND_DEPTH = 200.0
_GROUND_STIFFNESS = 1e8  # [N/m], as the wheels'


def add_plant(
    builder: DiagramBuilder,
    world: World,
    start: Sequence[float],
    time_step: float,
    joints: Sequence[float] = STOWED,
) -> tuple[MultibodyPlant, SceneGraph]:
    """Adds the robot in a world, standing at a place.

    Args:
        builder: of the diagram that gets plant and scene graph.
        world: the building.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        time_step: of the plant [s].
        joints: of the arm [rad], (6,).
    """
    plant, scene_graph = AddMultibodyPlant(
        builder=builder,
        config=MultibodyPlantConfig(
            time_step=time_step,
            contact_model="point",
            discrete_contact_approximation="lagged",
            # Sampled ports would make each step an unrestricted update.
            use_sampled_output_ports=False,
        ),
    )
    Parser(plant).AddModels(str(URDF))
    obstacles = add_world(plant, world)
    ground = ProximityProperties()
    AddContactMaterial(
        friction=CoulombFriction(1.0, 1.0),
        point_stiffness=_GROUND_STIFFNESS,
        properties=ground,
    )
    plant.RegisterCollisionGeometry(
        plant.world_body(),
        RigidTransform([0, 0, -_GROUND_DEPTH / 2]),
        Box(2 * _GROUND_REACH, 2 * _GROUND_REACH, _GROUND_DEPTH),
        "ground",
        ground,
    )
    scene_graph.collision_filter_manager().Apply(
        CollisionFilterDeclaration().ExcludeBetween(
            _rolling_geometries(plant),
            GeometrySet(obstacles),
        )
    )
    plant.Finalize()
    place_robot(plant, start, joints)
    return plant, scene_graph


def place_robot(
    plant: MultibodyPlant,
    start: Sequence[float],
    joints: Sequence[float] = STOWED,
) -> None:
    """Makes a place and arm joints the default ones of a plant's robot.

    Args:
        plant: finalized, with the robot in it.
        start: X_WB of the base, [x, y, yaw] in m and rad.
        joints: of the arm [rad], (6,).
    """
    x, y, yaw = start
    plant.SetDefaultFloatingBaseBodyPose(
        plant.GetBodyByName("base"),
        RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0]),
    )
    for name, q in zip(ARM_JOINTS, joints, strict=True):
        plant.GetJointByName(name).set_default_positions([q])


def select_joints(plant: MultibodyPlant, names: Sequence[str]) -> Array:
    """The matrix that picks joints out of the robot's state.

    Args:
        plant: finalized, with no other moving model than the robot.
        names: of the joints.

    Returns:
        (2 n, states): rows of the n positions, then of the n velocities.
    """
    joints = [plant.GetJointByName(name) for name in names]
    rows = [joint.position_start() for joint in joints] + [
        plant.num_positions() + joint.velocity_start() for joint in joints
    ]
    selection: Array = np.eye(plant.num_multibody_states())[rows]
    return selection


def obstacle_touch_test(
    plant: MultibodyPlant,
) -> Callable[[ContactResults], bool]:
    """Tells contacts of the robot with obstacles from all others."""
    robot = plant.GetModelInstanceByName(ROBOT)
    rolling = [False] * plant.num_bodies()
    touchable = [False] * plant.num_bodies()
    for index in plant.GetBodyIndices(robot):
        rolling[index] = plant.get_body(index).name() in ROLLING_BODIES
        touchable[index] = not rolling[index]

    def touches_obstacle(results: ContactResults) -> bool:
        contact = results.point_pair_contact_info
        for number in range(results.num_point_pair_contacts()):
            a = contact(number).bodyA_index()
            if rolling[a]:
                continue  # It meets nothing but the ground.
            b = contact(number).bodyB_index()
            if not rolling[b] and touchable[a] != touchable[b]:
                return True
        return False

    return touches_obstacle


def _rolling_geometries(plant: MultibodyPlant) -> GeometrySet:
    return GeometrySet(
        [
            geometry
            for name in ROLLING_BODIES
            for geometry in plant.GetCollisionGeometriesForBody(
                plant.GetBodyByName(name)
            )
        ]
    )
