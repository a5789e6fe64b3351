"""What Meshcat shows of navigation: highway, ways, forces, scan and path."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Cylinder, Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.perception import BaseField, Fields, PointCloud
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_mobarm.drawing.stage import (
    BEACON,
    ESTIMATE,
    FRAMES_PER_SECOND,
    HIDDEN,
    draw_marker,
    draw_path_piece,
    draw_ribbon,
    frame_places,
    light_stage,
)
from drake_mobarm.geometry import Array, transform_points
from drake_mobarm.navigation.highway import Highway
from drake_mobarm.navigation.job import NavigationScenario
from drake_mobarm.sensors.lidar import LidarParameters, ray_angles
from drake_mobarm.signals import (
    GroundTruth,
    NavigationForces,
    PlanarPose,
    TargetEstimate,
    size,
)

FORCES = {
    "attraction": Rgba(0.10, 0.60, 0.25),
    "repulsion": Rgba(0.85, 0.15, 0.15),
    "highway": Rgba(0.93, 0.45, 0.05),
}
"""Colour of each force's arrow."""

_HIGHWAY = Rgba(0.45, 0.35, 0.75)
_LINKS = Rgba(0.80, 0.77, 0.92)
_WAYS = Rgba(0.93, 0.45, 0.05, 0.8)
_SCAN = Rgba(0.80, 0.10, 0.50)
# The drawn path has a corner at least so often [m].
_SEGMENT = 0.10
# Ways and scan are drawn anew so often [s].
_REFRESH = 0.5
# An arrow's length for a force of 1 / m, and at the most [m].
_ARROW, _LONGEST = 0.6, 1.5
_HEIGHT = 0.75


def set_stage(meshcat: Meshcat, scenario: NavigationScenario) -> None:
    """Even light, no grid, and start and target both well in view."""
    light_stage(meshcat)
    frame_places(meshcat, scenario.start[:2], scenario.target)


class NavigationView(LeafSystem):
    """Draws the target, its estimate, ways, forces, scan, and path driven.

    .. pydrake_system::

        name: NavigationView
        input_ports:
        - ground_truth
        - estimated_target
        - measured_base_pose
        - lidar_ranges
        - navigation_forces
        - planned_paths

    - ground_truth (7): GroundTruth.
    - estimated_target (3): TargetEstimate in W.
    - measured_base_pose (3): PlanarPose in W.
    - lidar_ranges (rays): [m], as `ray_angles` orders them.
    - navigation_forces (6): NavigationForces in W.
    - planned_paths: abstract, a tuple of the corners p_WQ of each way [m],
      (k, 2) each.

    Args:
        meshcat: where to draw.
        target: p_WT [m], (2,).
        lidar: whose ranges these are.
        highway: that the robot is led along, if any.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        target: Sequence[float],
        lidar: LidarParameters,
        highway: Highway | None,
    ) -> None:
        super().__init__()
        self._meshcat, self._range_max = meshcat, lidar.range_max
        self._truth = self.DeclareVectorInputPort(
            "ground_truth", size(GroundTruth)
        )
        self._target = self.DeclareVectorInputPort(
            "estimated_target", size(TargetEstimate)
        )
        self._pose = self.DeclareVectorInputPort(
            "measured_base_pose", size(PlanarPose)
        )
        self._ranges = self.DeclareVectorInputPort("lidar_ranges", lidar.rays)
        self._forces = self.DeclareVectorInputPort(
            "navigation_forces", size(NavigationForces)
        )
        self._paths = self.DeclareAbstractInputPort("planned_paths", Value(()))
        # The last corner of the drawn path, how many pieces it has, and how
        # often ways and scan were drawn.
        self._drawn = self.DeclareDiscreteState([np.nan, np.nan, 0.0, 0.0])
        self.DeclarePeriodicDiscreteUpdateEvent(
            1 / FRAMES_PER_SECOND, 0.0, self._draw
        )
        draw_marker(meshcat, "target", BEACON, 0.07)
        meshcat.SetTransform("target", RigidTransform([*target, 0.0]))
        draw_marker(meshcat, "estimate", ESTIMATE, 0.09)
        meshcat.SetTransform("estimate", HIDDEN)
        for name, color in FORCES.items():
            # Its own x axis is the arrow's, so that scaling lengthens it.
            meshcat.SetObject(
                f"forces/{name}/arrow", Cylinder(0.02, 1.0), color
            )
            meshcat.SetTransform(
                f"forces/{name}/arrow",
                RigidTransform(RollPitchYaw(0, np.pi / 2, 0), [0.5, 0, 0]),
            )
            meshcat.SetTransform(f"forces/{name}", HIDDEN)
        if highway is not None:
            _draw_highway(meshcat, highway)

    def _draw(self, context: Context, state: DiscreteValues) -> None:
        time = context.get_time()
        drawn = context.get_discrete_state(self._drawn).value().tolist()
        corner, (pieces, refreshed) = np.array(drawn[:2]), map(int, drawn[2:])
        target = TargetEstimate(self._target.Eval(context))
        known = target.known > 0.5
        X_WT = RigidTransform([target.x, target.y, 0.0]) if known else HIDDEN
        self._meshcat.SetTransform("estimate", X_WT, time)
        here = np.array(GroundTruth(self._truth.Eval(context))[:2])
        self._draw_forces(self._forces.Eval(context), here, time)
        length = float(np.hypot(*(here - corner)))
        if np.isnan(length):
            corner = here
        elif length > _SEGMENT:
            path = f"path/{pieces:05d}"
            draw_path_piece(self._meshcat, path, corner, here, time)
            corner, pieces = here, pieces + 1
        if time >= refreshed * _REFRESH:
            self._refresh(context, refreshed)
            refreshed += 1
        state.set_value(self._drawn, [*corner, pieces, refreshed])

    def _draw_forces(self, forces: Array, here: Array, time: float) -> None:
        for name, force in zip(FORCES, forces.reshape(3, 2), strict=True):
            strength = float(np.hypot(*force))
            X_WF = HIDDEN
            if strength > 0:
                yaw = float(np.arctan2(force[1], force[0]))
                X_WF = RigidTransform(RollPitchYaw(0, 0, yaw), [*here, _HEIGHT])
            length = max(min(_ARROW * strength, _LONGEST), 1e-3)
            self._meshcat.SetTransform(f"forces/{name}", X_WF, time)
            self._meshcat.SetProperty(
                f"forces/{name}", "scale", [length, 1.0, 1.0], time
            )

    def _refresh(self, context: Context, number: int) -> None:
        """Draws the ways and the scan of now, to be seen until the next."""
        shown = f"now/{number:05d}"
        for index, path in enumerate(self._paths.Eval(context)):
            draw_ribbon(self._meshcat, f"{shown}/way{index}", path, _WAYS)
        ranges = self._ranges.Eval(context)
        met = ranges < self._range_max
        angles = ray_angles(ranges.size)[met]
        p_BP = ranges[met, None] * np.column_stack(
            [np.cos(angles), np.sin(angles)]
        )
        p_WP = transform_points(self._pose.Eval(context), p_BP)
        cloud = PointCloud(len(p_WP), Fields(BaseField.kXYZs))
        cloud.mutable_xyzs()[:] = np.column_stack(
            [p_WP, np.full(len(p_WP), 0.2)]
        ).T
        self._meshcat.SetObject(f"{shown}/scan", cloud, 0.04, _SCAN)
        time = context.get_time()
        self._meshcat.SetProperty(shown, "visible", False, 0.0)
        self._meshcat.SetProperty(shown, "visible", True, time)
        self._meshcat.SetProperty(shown, "visible", False, time + _REFRESH)


def _draw_highway(meshcat: Meshcat, highway: Highway) -> None:
    for number, point in enumerate(highway.points):
        path = f"highway/points/{number:04d}"
        meshcat.SetObject(path, Sphere(0.05), _HIGHWAY)
        meshcat.SetTransform(path, RigidTransform([*point, 0.03]))
    i, j = highway.links.T
    ends = [
        np.column_stack([highway.points[k], np.full(len(k), 0.02)]).T
        for k in (i, j)
    ]
    meshcat.SetLineSegments("highway/links", *ends, 1.0, _LINKS)
