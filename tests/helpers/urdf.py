"""The robot's URDF, as plain XML and as Drake has it."""

from xml.etree import ElementTree

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    MultibodyPlant,
)
from pydrake.systems.framework import DiagramBuilder

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.shape import URDF

ROBOT = ElementTree.parse(URDF).getroot()


def numbers(element, name):
    """The numbers of an attribute, (n,)."""
    return np.array([float(x) for x in element.get(name).split()])


def joint_origin(name):
    """Where a joint sits on its parent, unturned [m], (3,)."""
    origin = ROBOT.find(f"joint[@name='{name}']/origin")
    assert origin.get("rpy", "0 0 0") == "0 0 0"
    return numbers(origin, "xyz")


def collisions(link):
    """Name -> centre in the link's frame [m] and shape."""
    return {
        collision.get("name"): (
            numbers(collision.find("origin"), "xyz"),
            collision.find("geometry")[0],
        )
        for collision in ROBOT.findall(f"link[@name='{link}']/collision")
    }


def fixed_robot():
    """A plant of the robot alone, its base welded to W's origin."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(URDF))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    return plant


def set_arm(plant, context, q):
    """Sets the arm's joints, (6,) [rad]."""
    for name, angle in zip(ARM_JOINTS, q, strict=True):
        plant.GetJointByName(name).set_angle(context, angle)


class Robot:
    """The robot alone, with its geometry."""

    def __init__(self):
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        Parser(self.plant).AddModels(str(URDF))
        self.plant.Finalize()
        self.diagram = builder.Build()

    def pose(self, q):
        """The diagram's and the plant's context with the arm at `q`."""
        root = self.diagram.CreateDefaultContext()
        context = self.plant.GetMyMutableContextFromRoot(root)
        set_arm(self.plant, context, q)
        return root, context

    def frame(self, name, within, q=(0, 0, 0, 0, 0, 0)):
        _, context = self.pose(q)
        frame = self.plant.GetFrameByName(name)
        return frame.CalcPose(context, self.plant.GetFrameByName(within))
