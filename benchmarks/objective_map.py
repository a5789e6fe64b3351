"""How long the map of the objective takes, and a peer's.

    python benchmarks/objective_map.py [--repetitions 7] [--out FILE.md]

The objective (4.12) at all places of a 5 cm lattice in a disc around a target,
of all solutions of the arm. The peer is Drake alone: at a sample of places its
InverseKinematics, an optimisation from random guesses, finds joints that bring
the tip to the target along its approach, and its plant gives the torques and
the Jacobian; the disc's time is the sample's, per place. One core. Each
repetition maps all targets; the best tells what the code costs, the median
what a shared machine makes of it.
"""

import argparse
import os
import platform
import time
from importlib.metadata import version
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # One core.
os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from common import parse, processor, publish, use_one_core
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.solvers import Solve

from drake_mobarm.geometry import Array
from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.placement.free_space import FreeSpace
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
    sensitivities,
    singularity_factor,
    torque_score,
)
from drake_mobarm.placement.objective_map import score_places
from drake_mobarm.placement.problem import StandProblem, ToolTarget
from drake_mobarm.robot import WIDOWX_250, ArmKinematics
from drake_mobarm.robot.shape import ARM_BASE_HEIGHT, RADIUS, URDF

SEED = 0
TARGETS = 20
SPACING = 0.05  # [m]
RADII = (0.7, 1.4)  # Of discs [m].
DRAKE_PLACES = 4  # A target.
DRAKE_GUESSES = 4
SHOULDER_HEIGHT = float(np.asarray(WIDOWX_250.dh)[0, 1])  # [m]
# What Drake's constraints leave free; it cannot hold an angle of zero.
POSITION_TOLERANCE = 1e-5
ANGLE_TOLERANCE = 1e-3


def random_target(
    rng: np.random.Generator, low: Array, high: Array
) -> ToolTarget:
    """Anywhere over a box of the floor, along an approach not from below."""
    position = rng.uniform([*low, 0.1], [*high, 0.95])
    approach = rng.normal(size=3)
    approach[2] = -abs(approach[2])
    return ToolTarget(
        position=position, approach=approach / np.linalg.norm(approach)
    )


def disc(radius: float) -> Array:
    """Places of a lattice around the origin, (n, 2)."""
    steps = SPACING * np.arange(
        -np.ceil(radius / SPACING), radius / SPACING + 1
    )
    x, y = np.meshgrid(steps, steps)
    places = np.column_stack([x.ravel(), y.ravel()])
    return places[np.linalg.norm(places, axis=1) <= radius + 1e-9]


def within_reach(target: ToolTarget, places: Array, reach: float) -> Array:
    """Those of a target's places that are not plainly too far, (m, 2)."""
    height = target.p_WT[2] - ARM_BASE_HEIGHT - SHOULDER_HEIGHT
    return places[np.hypot(np.linalg.norm(places, axis=1), height) <= reach]


def measure_ours(
    problems: list[StandProblem], radius: float, repetitions: int
) -> dict[str, Any]:
    """One row: a map's time, the mean over the targets."""
    places = disc(radius)
    costs = []
    for _ in range(repetitions):
        started = time.perf_counter()
        maps = [
            score_places(problem, problem.target.p_WT[:2] + places)
            for problem in problems
        ]
        costs.append(1e3 * (time.perf_counter() - started) / len(problems))
    solved = [~np.isnan(scored.objective) for scored in maps]
    reach = problems[0].objective.arm.reach
    return {
        "radius_m": radius,
        "places": len(places),
        "places_within_reach": float(
            np.mean(
                [len(within_reach(p.target, places, reach)) for p in problems]
            )
        ),
        "places_solved": float(np.mean([s.any(axis=1).sum() for s in solved])),
        "solutions": float(np.mean([s.sum() for s in solved])),
        "best_ms": min(costs),
        "median_ms": float(np.median(costs)),
    }


class DrakePeer:
    """The same by Drake's plant and its inverse kinematics."""

    def __init__(self, parameters: ObjectiveParameters) -> None:
        self.parameters = parameters
        plant = MultibodyPlant(0.0)
        Parser(plant).AddModels(str(URDF))
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
        plant.Finalize()
        self.plant = plant
        self.context = plant.CreateDefaultContext()
        self.joints = np.array(
            [plant.GetJointByName(x).position_start() for x in ARM_JOINTS]
        )
        self.held = np.setdiff1d(
            np.arange(plant.num_positions()), self.joints[:-1]
        )
        self.lower = plant.GetPositionLowerLimits()
        self.upper = plant.GetPositionUpperLimits()

    def best(
        self, target: ToolTarget, place: Array, rng: np.random.Generator
    ) -> float:
        """The least objective over the guesses, infinite without any."""
        plant = self.plant
        tool, world = plant.GetFrameByName("tool"), plant.world_frame()
        tip = target.p_WT - [*place, 0.0]
        least = np.inf
        for _ in range(DRAKE_GUESSES):
            program = InverseKinematics(plant)
            program.AddPositionConstraint(
                tool,
                np.zeros(3),
                world,
                tip - POSITION_TOLERANCE,
                tip + POSITION_TOLERANCE,
            )
            program.AddAngleBetweenVectorsConstraint(
                world, target.a_W, tool, [1.0, 0.0, 0.0], 0.0, ANGLE_TOLERANCE
            )
            # The hand's turn about its approach is free: as ours has it.
            program.prog().AddBoundingBoxConstraint(
                0, 0, program.q()[self.held]
            )
            guess = np.zeros(plant.num_positions())
            guess[self.joints] = rng.uniform(
                self.lower[self.joints], self.upper[self.joints]
            )
            result = Solve(program.prog(), guess)
            if result.is_success():
                least = min(
                    least, self.objective(result.GetSolution(program.q()))
                )
        return least

    def objective(self, q: Array) -> float:
        """(4.12) of the plant's positions."""
        plant, context, p = self.plant, self.context, self.parameters
        plant.SetPositions(context, q)
        gravity = plant.CalcGravityGeneralizedForces(context)
        torque = torque_score(
            gravity[self.joints],
            WIDOWX_250.torque_limit,
            WIDOWX_250.torque_limit,
        )

        def jacobian(name: str) -> Array:
            J: Array = plant.CalcJacobianSpatialVelocity(
                context,
                JacobianWrtVariable.kV,
                plant.GetFrameByName(name),
                np.zeros(3),
                plant.world_frame(),
                plant.world_frame(),
            )[:, self.joints]
            return J

        # Of the wrist's frame the origin is where its axes meet.
        at_wrist, at_tip = jacobian("wrist"), jacobian("tool")
        sigma = singularity_factor(
            [
                np.linalg.det(at_wrist[3:, :3]),
                np.linalg.det(at_tip[:3, 3:]),
            ],
            p.singularity,
        )
        S_p, S_r = (
            float(
                sigma * np.linalg.norm(sensitivities(J, np.eye(3), np.ones(3)))
            )
            for J in (at_tip[3:], at_tip[:3])
        )
        return float(
            p.torque_weight * torque.sum()
            + p.position_weight * S_p
            + p.attitude_weight * S_r
        )


def measure_peer(problems: list[StandProblem]) -> dict[str, Any]:
    """What Drake needs for a place, and what it finds there."""
    objective = problems[0].objective
    peer = DrakePeer(objective.parameters)
    rng = np.random.default_rng(SEED)
    reach = objective.arm.reach
    first = problems[0].target
    peer.best(first, first.p_WT[:2] + 0.3, rng)  # Warm up.
    seconds, found, same, solvable = 0.0, 0, 0, 0
    for problem in problems:
        target = problem.target
        near = within_reach(target, disc(min(RADII)), reach)
        places = target.p_WT[:2] + rng.choice(near, DRAKE_PLACES, replace=False)
        started = time.perf_counter()
        theirs = np.array([peer.best(target, x, rng) for x in places])
        seconds += time.perf_counter() - started
        ours = score_places(problem, places).best
        solved = ~np.isnan(ours)
        solvable += int(solved.sum())
        found += int(np.isfinite(theirs[solved]).sum())
        same += int((theirs[solved] <= 1.01 * ours[solved]).sum())
    sample = DRAKE_PLACES * len(problems)
    return {
        "places": sample,
        "guesses": DRAKE_GUESSES,
        "ms_per_place": 1e3 * seconds / sample,
        "solvable": solvable,
        "found": found,
        "found_best": same,
    }


def main() -> None:
    """Measures, prints and, if asked, writes the table."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--repetitions", type=int, default=7)
    options = parse(parser)
    if options.repetitions < 1:
        parser.exit(2, "--repetitions: valid is 1 or more\n")
    use_one_core()
    objective = PlacementObjective(ArmKinematics(), ObjectiveParameters())
    rng = np.random.default_rng(SEED)
    floor = FreeSpace.from_outlines([], RADIUS, [0.0, 0.0])
    problems = [
        StandProblem(
            objective=objective,
            target=random_target(rng, np.zeros(2), np.ones(2)),
            free=floor,
        )
        for _ in range(TARGETS)
    ]
    measure_ours(problems, min(RADII), 1)  # Warm up.
    rows = [
        measure_ours(problems, radius, options.repetitions) for radius in RADII
    ]
    peer = measure_peer(problems)
    for row in rows:
        row["drake_extrapolated_ms"] = (
            peer["ms_per_place"] * row["places_within_reach"]
        )
    setting = {
        "command": "python benchmarks/objective_map.py --repetitions "
        f"{options.repetitions}",
        "processor": processor(),
        "cores": 1,
        "seed": SEED,
        "targets": TARGETS,
        "versions": {
            "Python": platform.python_version(),
            **{x: version(x) for x in ("numpy", "drake")},
        },
    }
    versions = ", ".join(f"{x} {y}" for x, y in setting["versions"].items())
    lines = [
        f"`{setting['command']}`",
        "",
        f"WidowX 250, {TARGETS} targets 0.1 to 0.95 m high, approaches not "
        f"from below, seed {SEED}, places {SPACING:g} m apart, "
        f"{options.repetitions} repetitions; one core of "
        f"{setting['processor']}; {versions}. Means over the targets:",
        "",
        "| disc's radius [m] | places | of them within the arm's length | with "
        "a solution | solutions | map, best [ms] | map, median [ms] | Drake, "
        "extrapolated [s] |",
        "|" + " ---: |" * 8,
    ]
    lines += [
        f"| {r['radius_m']:g} | {r['places']} | {r['places_within_reach']:.0f} "
        f"| {r['places_solved']:.0f} | {r['solutions']:.0f} | "
        f"{r['best_ms']:.2f} | {r['median_ms']:.2f} | "
        f"{r['drake_extrapolated_ms'] / 1e3:.1f} |"
        for r in rows
    ]
    lines += [
        "",
        f"Drake: InverseKinematics from {DRAKE_GUESSES} random guesses at each "
        f"of {DRAKE_PLACES} random places a target, within "
        f"{POSITION_TOLERANCE:g} m and {ANGLE_TOLERANCE:g} rad, and the "
        "objective from its plant: "
        f"{peer['ms_per_place']:.1f} ms a place, times the places within the "
        "arm's length, which is all that either looks at. Ours has all "
        "solutions of each place and takes the best; of "
        f"{peer['solvable']} sampled places with a solution Drake finds one "
        f"at {peer['found']}, and one within 1 % of the best at "
        f"{peer['found_best']}.",
    ]
    publish(
        lines,
        {"setting": setting, "ours": rows, "drake": peer},
        options.out,
    )


if __name__ == "__main__":
    main()
