"""The stand program, against central differences and the closed form."""

from dataclasses import replace

import numpy as np
import pytest

from drake_mobarm.placement.objective import PlacementObjective
from drake_mobarm.placement.objective_map import score_places
from drake_mobarm.placement.problem import SOLVED_JOINTS, ToolTarget
from drake_mobarm.placement.stand_program import StandProgram
from drake_mobarm.robot import APPENDIX_C, WIDOWX_250, ArmKinematics
from helpers.stands import (
    PLAIN,
    SMOOTH,
    TARGET,
    lattice,
    problem_of,
    random_target,
)

pytestmark = pytest.mark.filterwarnings("error")

ARMS = {"widowx": WIDOWX_250, "appendix_c": APPENDIX_C}


@pytest.fixture(params=list(ARMS))
def arm(request):
    return ArmKinematics(ARMS[request.param])


def program_and_joints(arm, seed):
    """A program, and joints that are away from singularities."""
    rng = np.random.default_rng(seed)
    q = np.zeros(6)
    while np.abs(arm.singularity_determinants(q)).min() < 0.005:
        q[:5] = rng.uniform(arm.lower, arm.upper)[:5]
    objective = PlacementObjective(arm, SMOOTH)
    problem = problem_of(random_target(rng), objective=objective)
    return StandProgram(problem, rng.uniform(-1, 1, 2), q), q, rng


def assert_gradient(law, x, rtol=1e-5, atol=1e-6):
    _, gradient = law(x)
    step = 1e-6
    columns = [
        (law(x + step * e)[0] - law(x - step * e)[0]) / (2 * step)
        for e in np.eye(len(x))
    ]
    np.testing.assert_allclose(
        gradient, np.stack(columns, axis=-1), rtol=rtol, atol=atol
    )


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_cost_is_that_of_central_differences(arm, seed):
    program, q, rng = program_and_joints(arm, seed)
    x = np.concatenate([q[:5], rng.uniform(0.01, 1, 30)])
    assert_gradient(program.cost, x, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_reach_error_is_that_of_central_differences(arm, seed):
    program, q, rng = program_and_joints(arm, seed)
    assert_gradient(
        program.reach_error, np.concatenate([rng.uniform(-1, 1, 2), q[:5]])
    )


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_magnitude_excess_is_that_of_central_differences(
    arm, seed
):
    program, q, rng = program_and_joints(arm, seed)
    assert_gradient(
        program.magnitude_excess, np.concatenate([q[:5], rng.uniform(0, 1, 30)])
    )


@pytest.mark.parametrize("seed", range(8))
def test_gradient_of_the_distance_to_the_target_is_that_of_central_differences(
    arm, seed
):
    program, _, rng = program_and_joints(arm, seed)
    assert_gradient(program.distance_to_target, rng.uniform(-2, 2, 2))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(
    "parameters",
    [PLAIN, SMOOTH, replace(SMOOTH, singularity=0.0)],
    ids=["plain", "odd", "no_singularity"],
)
def test_cost_of_the_least_magnitudes_is_the_objective(arm, parameters, seed):
    rng = np.random.default_rng(seed)
    objective = PlacementObjective(arm, parameters)
    q = rng.uniform(arm.lower, arm.upper)
    q[5] = 0.0
    # As the sixth joint turns about the approach, the target's is the tool's.
    target = ToolTarget(position=[0, 0, 0.5], approach=arm.forward(q)[:3, 0])
    problem = problem_of(target, objective=objective)
    program = StandProgram(problem, np.zeros(2), q)
    x = np.concatenate([q[:5], np.zeros(30)])
    # Magnitudes of 0 fall short of each element by its absolute value.
    short = program.magnitude_excess(x)[0].reshape(2, 30).min(axis=0)
    x[SOLVED_JOINTS:] = -short
    assert np.all(program.magnitude_excess(x)[0] >= 0)
    assert program.cost(x)[0][0] == pytest.approx(
        float(objective.scores(q).objective), rel=1e-12
    )


def test_reach_error_is_zero_where_the_closed_form_says_so():
    problem = problem_of(TARGET)
    scored = score_places(problem, lattice(TARGET, 0.1))
    program = None
    for place, q in zip(scored.places, scored.best_q, strict=True):
        if np.isnan(q).any():
            continue
        program = StandProgram(problem, place, q)
        error, _ = program.reach_error(np.concatenate([place, q[:5]]))
        np.testing.assert_allclose(error, 0, atol=1e-12)
    assert program is not None
