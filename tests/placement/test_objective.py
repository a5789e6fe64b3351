"""The objective of joint positions, step by step with Drake's plant."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydrake.math import RollPitchYaw
from pydrake.multibody.tree import JacobianWrtVariable

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.placement.objective import (
    ObjectiveParameters,
    PlacementObjective,
    Scores,
)
from drake_mobarm.robot import APPENDIX_C, WIDOWX_250, ArmKinematics
from helpers.stands import ARM, ODD, PLAIN, random_joints
from helpers.urdf import set_arm

# Nothing here may warn, singular positions included.
pytestmark = pytest.mark.filterwarnings("error")


def central(law, x, step=1e-6):
    """Derivative of a law by the last axis of x, one more axis at the end."""
    parts = []
    for i in range(x.shape[-1]):
        e = np.zeros(x.shape[-1])
        e[i] = step
        parts.append((law(x + e) - law(x - e)) / (2 * step))
    return np.stack(parts, axis=-1)


# Axes and singularities


def test_axes_are_the_columns_of_roll_pitch_yaw():
    # Only the first axis counts; yaw 90 degrees lays it along y of W.
    parameters = ObjectiveParameters(
        position_axes=[0, 0, math.pi / 2],
        position_axis_weights=[1, 0, 0],
        singularity=0,
    )
    q = random_joints(1)
    scores = PlacementObjective(ARM, parameters).scores(q)
    assert scores.position == pytest.approx(np.abs(ARM.jacobian(q)[1]).sum())


def test_singular_positions_have_an_infinite_objective_and_no_nan():
    straight_wrist = random_joints(2)
    straight_wrist[4] = 0.0
    straight_wrist = straight_wrist[None]
    scores = PlacementObjective(ARM, PLAIN).scores(straight_wrist)
    for name in ("position", "attitude", "singularity", "objective"):
        assert getattr(scores, name) == np.inf
    assert np.isfinite(scores.torque)


@pytest.mark.parametrize("weight", ["position_weight", "attitude_weight"])
def test_no_weight_of_zero_makes_nan_of_a_singularity(weight):
    q = random_joints(2)
    q[4] = 0.0
    only_torque = replace(PLAIN, position_weight=0.0, attitude_weight=0.0)
    scores = PlacementObjective(ARM, only_torque).scores(q)
    assert scores.objective == scores.torque
    other = PlacementObjective(ARM, replace(PLAIN, **{weight: 0.0}))
    assert other.scores(q).objective == np.inf


# (4.3), (4.10) to (4.12) from Drake's plant


def scores_by_drake(plant, q, p, payload_force=0.0):
    """The parts, (4.2) to (4.12) one after the other as printed."""
    context = plant.CreateDefaultContext()
    joints = [plant.GetJointByName(name) for name in ARM_JOINTS]
    set_arm(plant, context, q)
    columns = [joint.velocity_start() for joint in joints]

    def jacobian(frame):
        J = plant.CalcJacobianSpatialVelocity(
            context,
            JacobianWrtVariable.kV,
            plant.GetFrameByName(frame),
            np.zeros(3),
            plant.world_frame(),
            plant.world_frame(),
        )[:, columns]
        return J[3:], J[:3]  # Drake has w first.

    J_v, J_w = jacobian("tool")
    tau = plant.CalcGravityGeneralizedForces(context)[columns]
    tau = tau - 9.81 * payload_force * J_v[2]
    T = 0.0
    shape = p.torque_shape or WIDOWX_250.torque_limit
    for tau_i, r, a in zip(tau, WIDOWX_250.torque_limit, shape, strict=True):
        T += -abs(tau_i) * (a / (min(abs(tau_i), r - 0.01) - r) + 1)

    def length(J, axes, weights):
        w = np.array(weights) / math.hypot(*weights)
        R_WA = RollPitchYaw(axes).ToRotationMatrix().matrix()
        J_new = np.diag(w) @ R_WA.T @ J
        return math.hypot(*(sum(abs(x) for x in row) for row in J_new))

    # The wrist's link turns about the wrist's centre: joints 1 to 3 move it.
    J11 = jacobian("wrist")[0][:, :3]
    J22 = J_w[:, 3:]
    sigma = p.singularity / abs(np.linalg.det(J11) * np.linalg.det(J22)) + 1
    S_p = sigma * length(J_v, p.position_axes, p.position_axis_weights)
    S_r = sigma * length(J_w, p.attitude_axes, p.attitude_axis_weights)
    j = p.torque_weight * T + p.position_weight * S_p + p.attitude_weight * S_r
    load = max(abs(tau) / np.array(WIDOWX_250.torque_limit))
    return Scores(T, S_p, S_r, sigma, j, load)


@pytest.mark.parametrize("parameters", [PLAIN, ODD], ids=["plain", "odd"])
@pytest.mark.parametrize("seed", range(5))
def test_scores_are_those_worked_step_by_step_from_drakes_plant(
    plant, parameters, seed
):
    q = random_joints(seed)
    ours = PlacementObjective(ARM, parameters).scores(q)
    theirs = scores_by_drake(plant, q, parameters, parameters.payload)
    for field in fields(Scores):
        assert getattr(ours, field.name) == pytest.approx(
            getattr(theirs, field.name), rel=1e-9
        ), field.name


def test_batch_of_any_shape_has_the_scores_of_its_items():
    q = random_joints(3, (2, 4))
    objective = PlacementObjective(ARM, ODD)
    together = objective.scores(q)
    for index in np.ndindex(2, 4):
        alone = objective.scores(q[index])
        for field in fields(Scores):
            assert getattr(together, field.name)[index] == pytest.approx(
                getattr(alone, field.name), rel=1e-12
            )


@given(st.integers(0, 10**6), st.floats(-3, 3))
def test_turning_waist_and_axes_together_changes_no_score(seed, turn):
    q = random_joints(seed)
    turned = PlacementObjective(
        ARM,
        replace(
            ODD,
            # Fixed axes: yaw comes last.
            position_axes=[*ODD.position_axes[:2], ODD.position_axes[2] + turn],
            attitude_axes=[*ODD.attitude_axes[:2], ODD.attitude_axes[2] + turn],
        ),
    )
    before = PlacementObjective(ARM, ODD).scores(q)
    after = turned.scores(q + turn * np.eye(6)[0])
    for field in fields(Scores):
        assert getattr(after, field.name) == pytest.approx(
            getattr(before, field.name), rel=1e-9
        )


def test_nan_joints_have_nan_scores():
    q = random_joints(4, (3,))
    q[1] = np.nan
    scores = PlacementObjective(ARM, PLAIN).scores(q)
    for field in fields(Scores):
        np.testing.assert_array_equal(
            np.isnan(getattr(scores, field.name)), [False, True, False]
        )


def test_payload_raises_the_torque_score_and_nothing_else():
    # Stretched out forward every link pulls the same way as the payload.
    q = np.array([0.0, 1.2, -1.0, 0.0, 0.4, 0.0])
    light = PlacementObjective(ARM, PLAIN).scores(q)
    heavy = PlacementObjective(ARM, replace(PLAIN, payload=0.3)).scores(q)
    assert heavy.torque > 1.2 * light.torque
    for name in ("position", "attitude", "singularity"):
        assert getattr(heavy, name) == getattr(light, name)


def test_each_weight_counts_its_own_part():
    q = random_joints(5)
    parts = ("torque", "position", "attitude")
    for part in parts:
        weights = {f"{name}_weight": 0.0 for name in parts}
        weights[f"{part}_weight"] = 2.5
        scores = PlacementObjective(ARM, replace(PLAIN, **weights)).scores(q)
        assert scores.objective == pytest.approx(2.5 * getattr(scores, part))


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_derivative_of_the_torque_part_is_that_of_central_differences(seed):
    # The least shape: no corner at zero torque, which the waist always has.
    objective = PlacementObjective(ARM, replace(ODD, torque_shape=[]))
    q = random_joints(seed)
    tau = ARM.holding_torque(q, ODD.payload)
    assume(np.abs(np.abs(tau) - (ARM.torque_limit - 0.01)).min() > 1e-3)
    value, slope = objective.torque_and_derivative(q)

    def torque(q):
        return objective.scores(q).torque

    assert value == torque(q)
    np.testing.assert_allclose(slope, central(torque, q), rtol=1e-4, atol=1e-5)


def test_derivative_of_the_torque_part_takes_batches():
    q = random_joints(6, (2, 3))
    objective = PlacementObjective(ARM, ODD)
    value, slope = objective.torque_and_derivative(q)
    assert value.shape == (2, 3)
    assert slope.shape == (2, 3, 6)
    np.testing.assert_allclose(
        slope[1, 2], objective.torque_and_derivative(q[1, 2])[1]
    )


def test_other_arms_are_scored_by_their_own_torque_limits():
    weak = replace(APPENDIX_C, torque_limit=[4.1, 3.0, 3.0, 4.1, 4.1, 1.5])
    q = np.array([0.1, 0.7, -0.6, 0.2, 0.9, 0.3])
    strong_T, weak_T = (
        PlacementObjective(ArmKinematics(arm), PLAIN).scores(q).torque
        for arm in (APPENDIX_C, weak)
    )
    assert weak_T > strong_T
