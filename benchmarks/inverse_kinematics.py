"""How long inverse kinematics of the arm takes: this library and its peers.

    python benchmarks/inverse_kinematics.py [--poses 100000] [--out FILE.md]

The same poses for all, of joint angles drawn evenly within the limits: this
library's closed form, EAIK (`pip install -e '.[peers]'`), which derives its
own from the same Denavit-Hartenberg rows, and Drake's InverseKinematics, an
optimisation, from the middle of the joints' ranges. One core. Each is
repeated; the best repetition tells what the code costs, the median what a
shared machine makes of it. Every solution is put back through the forward
kinematics, which the tests hold against Drake's plant.

A second table has single poses, one call each, as a control loop has them. A
third has poses near the singularities of wrist and elbow: there angles are
lost, not poses.
"""

import argparse
import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # One core.
os.environ["OMP_NUM_THREADS"] = "1"

import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np
from arm_peers import (
    ANGLE_TOLERANCE,
    POSITION_TOLERANCE,
    DhRobot,
    DrakeSolver,
    Eaik,
)
from common import parse, processor, publish, use_one_core
from numpy.typing import NDArray

from drake_mobarm.robot import WIDOWX_250, ArmKinematics

Array = NDArray[np.float64]

SEED = 0
SINGLE_POSES = 2000
DRAKE_POSES = 200
SINGULAR_POSES = 10_000
LIMIT_TOLERANCE = 1e-9
# Pose error up to which a solution near a singularity counts as right.
RIGHT = 1e-6

ARM = ArmKinematics(WIDOWX_250)
MIDDLE = (ARM.lower + ARM.upper) / 2


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


def timed(
    call: Callable[[], Any], n: int, repetitions: int
) -> tuple[list[float], Any]:
    """Times of a call for n poses [us a pose], and its last result."""
    times = []
    for _ in range(repetitions):
        started = time.perf_counter()
        result = call()
        times.append((time.perf_counter() - started) / n * 1e6)
    return times, result


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
    times, result = timed(solve, len(X_BT), repetitions)
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


def regular_rows(n: int, repetitions: int) -> list[Row]:
    """The first table."""
    rng = np.random.default_rng(SEED)
    X_BT = ARM.forward(rng.uniform(ARM.lower, ARM.upper, (n, 6)))
    some, few = X_BT[:SINGLE_POSES], X_BT[:DRAKE_POSES]
    eaik, drake = Eaik(), DrakeSolver(MIDDLE)
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


def single_rows(repetitions: int) -> list[dict[str, Any]]:
    """The second table: one call a pose, ours and EAIK's."""
    rng = np.random.default_rng(SEED)
    q = rng.uniform(ARM.lower, ARM.upper, (SINGLE_POSES, 6))
    X_BT = ARM.forward(q)
    eaik = Eaik()
    theta, X_B6 = list(q + eaik.offset), eaik.convert(X_BT)
    rows = []
    for name, ours, poses, theirs, their_poses in (
        ("forward", ARM.forward, q, eaik.robot.fwdKin, theta),
        ("jacobian", ARM.jacobian, q, None, None),
        ("inverse, with limits", ARM.inverse, X_BT, None, None),
        (
            "inverse, without limits",
            partial(ARM.inverse, limits=False),
            X_BT,
            eaik.robot.IK,
            X_B6,
        ),
    ):
        row: dict[str, Any] = {"name": name}
        for who, call, given in (
            ("ours", ours, poses),
            ("EAIK", theirs, their_poses),
        ):
            if call is None:
                row[who] = None
                continue
            times, _ = timed(
                lambda call=call, given=given: [call(x) for x in given],
                SINGLE_POSES,
                repetitions,
            )
            row[who] = {
                "best_us": min(times),
                "median_us": float(np.median(times)),
            }
        rows.append(row)
    return rows


def singular_rows() -> list[dict[str, Any]]:
    """The third table: the poses near the singularities."""
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
    single = single_rows(options.repetitions)
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
        f"One pose a call, {SINGLE_POSES} poses, ours in Python's floats, "
        "EAIK's compiled; EAIK has no limits and no Jacobian:",
        "",
        "| call | ours, best [us] | ours, median [us] | EAIK, best [us] | "
        "EAIK, median [us] | ours / EAIK, median |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for row in single:
        ours, theirs = row["ours"], row["EAIK"]
        line = f"| {row['name']} | {ours['best_us']:.2f} | "
        line += f"{ours['median_us']:.2f} | "
        if theirs is None:
            lines.append(line + "- | - | - |")
            continue
        ratio = ours["median_us"] / theirs["median_us"]
        lines.append(
            line + f"{theirs['best_us']:.2f} | {theirs['median_us']:.2f} | "
            f"{ratio:.1f} |"
        )
    lines += [
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
        "single": single,
        "near_singular": singular,
    }
    publish(lines, measured, options.out)


if __name__ == "__main__":
    main()
