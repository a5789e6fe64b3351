"""What a run of the placement scenario reports."""

import numpy as np

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.placement.planner import Placement


def placement_metrics(placement: Placement) -> dict[str, float]:
    """The metrics of a placement: of its stand and of its map.

    Returns:
        For the stand, NaN where there is none: its pose and joint positions,
        the objective (4.12) and its parts as (4.3), (4.9), (4.10) and (4.11)
        define them, and the largest ratio of a joint's holding torque to its
        limit. For the map: the objective of the best square, the numbers of
        free and of attractive squares, and the share of the free area that
        the free squares cover.
    """
    grid, stand = placement.grid, placement.stand
    pose = np.full(3, np.nan) if stand is None else stand.pose
    q = np.full(len(ARM_JOINTS), np.nan) if stand is None else stand.q
    metrics = {
        "stand_x_m": float(pose[0]),
        "stand_y_m": float(pose[1]),
        "stand_yaw_rad": float(pose[2]),
        **{
            f"{name}_rad": float(angle)
            for name, angle in zip(ARM_JOINTS, q, strict=True)
        },
    }
    for name, part in (
        ("objective", "objective"),
        ("torque_score_n_m", "torque"),
        ("position_sensitivity_m_per_rad", "position"),
        ("attitude_sensitivity", "attitude"),
        ("singularity_factor", "singularity"),
        ("largest_load", "load"),
    ):
        metrics[name] = (
            np.nan if stand is None else float(getattr(stand.scores, part))
        )
    best = placement.objective[:1]
    metrics["best_square_objective"] = float(best[0]) if len(best) else np.nan
    metrics["attractive_squares"] = float(len(placement.squares))
    metrics["free_squares"] = float(len(grid.centres))
    metrics["free_area_covered"] = grid.coverage
    return metrics
