"""How long inverse kinematics of the arm takes: this library and its peers.

    python benchmarks/inverse_kinematics.py [--poses 100000] [--out FILE.md]

The same poses for all, of joint angles drawn evenly within the limits: this
library's closed form, EAIK (`pip install -e '.[peers]'`), which derives its
own from the same Denavit-Hartenberg rows, and Drake's InverseKinematics, an
optimisation, from the middle of the joints' ranges. One core. Each is
repeated; the best repetition tells what the code costs, the median what a
shared machine makes of it. Every solution is put back through the forward
kinematics, which the tests hold against Drake's plant.

A second table has poses near the singularities of wrist and elbow: there
angles are lost, not poses.
"""

import argparse
import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # One core.
os.environ["OMP_NUM_THREADS"] = "1"

import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from common import parse, processor, publish, use_one_core
from numpy.typing import NDArray
from pydrake.math import RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.solvers import Solve

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot import WIDOWX_250, ArmKinematics
from drake_mobarm.robot.shape import URDF

try:
    from eaik.IK_DH import DhRobot
except ImportError:
    DhRobot = None

Array = NDArray[np.float64]

SEED = 0
SINGLE_POSES = 2000
DRAKE_POSES = 200
SINGULAR_POSES = 10_000
# What Drake's constraints leave free; it cannot hold an angle of zero.
POSITION_TOLERANCE = 1e-5
ANGLE_TOLERANCE = 1e-3
LIMIT_TOLERANCE = 1e-9
# Pose error up to which a solution near a singularity counts as right.
RIGHT = 1e-6

ARM = ArmKinematics(WIDOWX_250)
MIDDLE = (ARM.lower + ARM.upper) / 2
# Axes of the tool's frame in DH frame 6, which is EAIK's last.
X_6T = np.array([[0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])


@dataclass
class Row:
    """One line of the table."""

    name: str
    poses: int
    best_us: float
    median_us: float
    worst_pose_error: float
    solutions: float
    solved_percent: float


def nearest_turn(q: Array) -> Array:
    """Each angle in the turn nearest to the middle of its joint's range."""
    from_middle = q - MIDDLE
    turns = np.rint(from_middle / (2 * np.pi))
    nearest: Array = MIDDLE + from_middle - 2 * np.pi * turns
    return nearest


def within_limits(q: Array) -> Array:
    """Solutions, those beyond a limit replaced by NaN."""
    q = nearest_turn(q)
    inside = (q >= ARM.lower - LIMIT_TOLERANCE) & (
        q <= ARM.upper + LIMIT_TOLERANCE
    )
    return np.where(inside.all(axis=-1, keepdims=True), q, np.nan)


def pose_error(q: Array, X_BT: Array) -> Array:
    """Largest deviation of any entry of the pose, NaN where q is."""
    deviation: Array = np.abs(ARM.forward(q) - X_BT[:, None]).max(axis=(-1, -2))
    return deviation


def measure(
    name: str,
    solve: Callable[[], Any],
    gather: Callable[[Any], Array],
    X_BT: Array,
    repetitions: int,
) -> Row:
    """Times `solve` for all of the poses; only then looks at its result.

    Args:
        name: what the table calls it.
        solve: solves for all of the poses.
        gather: takes its result, returns joint positions (n, k, 6), NaN
            where there is no solution.
        X_BT: the poses, (n, 4, 4).
        repetitions: how often.
    """
    times = []
    for _ in range(repetitions):
        started = time.perf_counter()
        result = solve()
        times.append((time.perf_counter() - started) / len(X_BT) * 1e6)
    q = within_limits(gather(result))
    there = ~np.isnan(q).any(axis=-1)
    return Row(
        name,
        len(X_BT),
        min(times),
        float(np.median(times)),
        float(np.nanmax(pose_error(q, X_BT))),
        float(there.sum(axis=1).mean()),
        100 * float(there.any(axis=1).mean()),
    )


class Eaik:
    """EAIK's solver for the same Denavit-Hartenberg rows."""

    def __init__(self) -> None:
        self.offset, d, a, alpha = np.asarray(WIDOWX_250.dh).T
        self.robot = DhRobot(alpha, a, d)

    @staticmethod
    def convert(X_BT: Array) -> list[Array]:
        """Poses as EAIK takes them, of DH frame 6."""
        return list(np.ascontiguousarray(X_BT @ X_6T.T))

    def gather(self, results: list[Any], *, approximate: bool = False) -> Array:
        """Solutions (n, 8, 6), NaN where there is none.

        Args:
            results: EAIK's.
            approximate: whether to keep what EAIK itself calls so.
        """
        count = np.array([len(result.Q) for result in results])
        rows = np.repeat(np.arange(len(results)), count)
        columns = np.arange(len(rows)) - np.repeat(
            np.cumsum(count) - count, count
        )
        solutions = np.concatenate([result.Q for result in results])
        if not approximate:
            poor = np.concatenate([result.is_LS for result in results])
            solutions[poor.astype(bool)] = np.nan
        q = np.full((len(results), 8, 6), np.nan)
        q[rows, columns] = solutions - self.offset
        return q


class DrakeSolver:
    """Drake's InverseKinematics on the plant, base and wheels held."""

    def __init__(self) -> None:
        self.plant = MultibodyPlant(0.0)
        Parser(self.plant).AddModels(str(URDF))
        self.plant.WeldFrames(
            self.plant.world_frame(), self.plant.GetFrameByName("base")
        )
        self.plant.Finalize()
        self.base = self.plant.GetFrameByName("arm_base")
        self.tool = self.plant.GetFrameByName("tool")
        self.joints = [
            self.plant.GetJointByName(name).position_start()
            for name in ARM_JOINTS
        ]
        self.guess = np.zeros(self.plant.num_positions())
        self.guess[self.joints] = MIDDLE

    def solve(self, X_BT: Array) -> Array:
        """One solution, (1, 6), NaN if it finds none."""
        problem = InverseKinematics(self.plant)
        p_BT = X_BT[:3, 3]
        problem.AddPositionConstraint(
            frameB=self.tool,
            p_BQ=[0, 0, 0],
            frameA=self.base,
            p_AQ_lower=p_BT - POSITION_TOLERANCE,
            p_AQ_upper=p_BT + POSITION_TOLERANCE,
        )
        problem.AddOrientationConstraint(
            frameAbar=self.base,
            R_AbarA=RotationMatrix(X_BT[:3, :3]),
            frameBbar=self.tool,
            R_BbarB=RotationMatrix(),
            theta_bound=ANGLE_TOLERANCE,
        )
        wheels = np.delete(problem.q(), self.joints)
        problem.prog().AddBoundingBoxConstraint(0, 0, wheels)
        result = Solve(problem.prog(), self.guess)
        if not result.is_success():
            return np.full((1, 6), np.nan)
        q: Array = result.GetSolution(problem.q())[self.joints]
        return q[None]


def regular_rows(n: int, repetitions: int) -> list[Row]:
    """The first table."""
    rng = np.random.default_rng(SEED)
    X_BT = ARM.forward(rng.uniform(ARM.lower, ARM.upper, (n, 6)))
    some, few = X_BT[:SINGLE_POSES], X_BT[:DRAKE_POSES]
    eaik, drake = Eaik(), DrakeSolver()
    converted = eaik.convert(X_BT)
    # Warm up: what is loaded or reserved once counts for nobody.
    ARM.inverse(X_BT[:5000])
    eaik.robot.IK_batched(converted[:5000], 1)
    drake.solve(X_BT[0])
    return [
        measure(
            "ours, batch, with limits",
            lambda: ARM.inverse(X_BT),
            lambda q: q,
            X_BT,
            repetitions,
        ),
        measure(
            "ours, batch, without limits",
            lambda: ARM.inverse(X_BT, limits=False),
            lambda q: q,
            X_BT,
            repetitions,
        ),
        measure(
            "EAIK, batch, solver alone",
            lambda: eaik.robot.IK_batched(converted, 1),
            eaik.gather,
            X_BT,
            repetitions,
        ),
        measure(
            "EAIK, batch, with limits",
            lambda: within_limits(
                eaik.gather(eaik.robot.IK_batched(converted, 1))
            ),
            lambda q: q,
            X_BT,
            repetitions,
        ),
        measure(
            "ours, pose by pose, with limits",
            lambda: np.array([ARM.inverse(X) for X in some]),
            lambda q: q,
            some,
            repetitions,
        ),
        measure(
            "EAIK, pose by pose, solver alone",
            lambda: [eaik.robot.IK(X) for X in converted[: len(some)]],
            eaik.gather,
            some,
            repetitions,
        ),
        measure(
            "Drake InverseKinematics, SNOPT",
            lambda: np.array([drake.solve(X) for X in few]),
            lambda q: q,
            few,
            min(repetitions, 3),
        ),
    ]


def singular_rows() -> list[dict[str, Any]]:
    """The second table: the poses near the singularities."""
    rng = np.random.default_rng(SEED)
    straight = -np.pi / 2 - np.asarray(WIDOWX_250.dh)[2, 0]
    eaik = Eaik()
    rows = []
    for kind in ("wrist", "elbow", "both"):
        q = rng.uniform(ARM.lower, ARM.upper, (SINGULAR_POSES, 6))
        for joint, middle, others in (
            (4, 0.0, "elbow"),
            (2, straight, "wrist"),
        ):
            if kind != others:
                size = 10 ** rng.uniform(-16, -1, SINGULAR_POSES)
                q[:, joint] = middle + size * rng.choice([-1, 1], len(q))
        X_BT = ARM.forward(q)
        theirs = eaik.robot.IK_batched(eaik.convert(X_BT), 1)
        every = ARM.inverse(X_BT, limits=False)
        for name, exact, solutions in (
            ("ours", every, every),
            (
                "EAIK",
                eaik.gather(theirs),
                eaik.gather(theirs, approximate=True),
            ),
        ):
            right = pose_error(solutions, X_BT) < RIGHT
            rows.append(
                {
                    "near": kind,
                    "name": name,
                    "worst_pose_error": float(
                        np.nanmax(pose_error(exact, X_BT))
                    ),
                    "solutions": float(
                        (~np.isnan(exact).any(axis=-1)).sum(axis=1).mean()
                    ),
                    "right": float(right.sum(axis=1).mean()),
                    "poses_without": int((~right.any(axis=1)).sum()),
                }
            )
    return rows


def main() -> None:
    """Measures, prints and, if asked, writes the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=100_000)
    parser.add_argument("--repetitions", type=int, default=7)
    options = parse(parser)
    if DhRobot is None:
        parser.exit(2, "EAIK is not installed: pip install -e '.[peers]'\n")
    if options.poses < SINGLE_POSES or options.repetitions < 1:
        parser.exit(
            2,
            f"--poses is {options.poses}, --repetitions is "
            f"{options.repetitions}: valid is {SINGLE_POSES} or more, and 1 "
            "or more\n",
        )
    use_one_core()
    rows = regular_rows(options.poses, options.repetitions)
    singular = singular_rows()
    setting = {
        "command": f"python benchmarks/inverse_kinematics.py --poses "
        f"{options.poses} --repetitions {options.repetitions}",
        "processor": processor(),
        "cores": 1,
        "seed": SEED,
        "versions": {
            "Python": platform.python_version(),
            **{x: version(x) for x in ("numpy", "EAIK", "drake")},
        },
    }
    versions = ", ".join(f"{x} {y}" for x, y in setting["versions"].items())
    lines = [
        f"`{setting['command']}`",
        "",
        f"WidowX 250, poses of joint angles drawn evenly within the limits, "
        f"seed {SEED}; one core of {setting['processor']}; {versions}.",
        "",
        "| solver | poses | best [us/pose] | median [us/pose] | worst pose "
        "error | solutions within limits | poses solved [%] |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    lines += [
        f"| {row.name} | {row.poses} | {row.best_us:.2f} | "
        f"{row.median_us:.2f} | {row.worst_pose_error:.1e} | "
        f"{row.solutions:.3f} | {row.solved_percent:.1f} |"
        for row in rows
    ]
    lines += [
        "",
        "The error is the largest deviation of any entry of the 4x4 pose, "
        "over all solutions. EAIK knows no joint limits: it gives all eight "
        'solutions, in turns of its own. "Solver alone" is the time until '
        'it has its objects; "with limits" also gathers them in one array, '
        "brings each angle into its joint's turn and leaves out what is beyond "
        "a limit, as ours does. Its poses are converted beforehand. Drake's "
        "is one optimisation a pose, and finds one solution or none, from the "
        "middle of the joints' ranges, within "
        f"{POSITION_TOLERANCE:g} m and {ANGLE_TOLERANCE:g} rad; the time "
        "is that of the whole call, the program's making included.",
        "",
        f"Near singularities, {SINGULAR_POSES} poses each, wrist and elbow "
        "10^-16 to 10^-1 rad from straight, without limits. EAIK calls "
        "approximate what it finds no exact solution for, rounding included:",
        "",
        "| near | solver | solutions called exact | worst pose error of these |"
        f" solutions right to {RIGHT:g} | poses without |",
        "| --- | --- | ---: | ---: | ---: | ---: |",
    ]
    lines += [
        f"| {row['near']} | {row['name']} | {row['solutions']:.3f} | "
        f"{row['worst_pose_error']:.1e} | {row['right']:.3f} | "
        f"{row['poses_without']} |"
        for row in singular
    ]
    measured = {
        "setting": setting,
        "regular": [asdict(row) for row in rows],
        "near_singular": singular,
    }
    publish(lines, measured, options.out)


if __name__ == "__main__":
    main()
