"""The base's kinematics and dynamics, by hand and against Drake."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import BodyIndex, MultibodyForces
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_mobarm.joints import ARM_JOINTS
from drake_mobarm.robot.differential_drive import DifferentialDrive
from drake_mobarm.robot.shape import STOWED, URDF
from helpers.bases import HAND_WORKED
from helpers.refusals import assert_refused
from helpers.urdf import set_arm

SPEED = st.floats(-2, 2)
PAIR = st.tuples(SPEED, SPEED)
ROUND = DifferentialDrive(wheel_radius=0.1, track=0.4)


def add_robot(time_step, ground=False):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(
        builder=builder,
        config=MultibodyPlantConfig(
            time_step=time_step,
            contact_model="point",
            discrete_contact_approximation="lagged" if time_step else "sap",
        ),
    )
    Parser(plant).AddModels(str(URDF))
    if ground:
        plant.RegisterCollisionGeometry(
            plant.world_body(),
            RigidTransform([0, 0, -1]),
            Box(20, 20, 2),
            "ground",
            CoulombFriction(1.0, 1.0),
        )
    plant.Finalize()
    return builder.Build(), plant


@pytest.fixture(scope="module")
def stowed():
    """A plant whose base stands at the origin, the arm stowed."""
    _, plant = add_robot(0.0)
    context = plant.CreateDefaultContext()
    set_arm(plant, context, STOWED)
    return plant, context


def acceleration(base, torques, v, w):
    """(7.6), (7.7) read from left to right: what the torques do."""
    left, right = torques
    r, b, inertia_wheel = base.wheel_radius, base.track, base.wheel_inertia
    lever = base.body_mass * base.com_offset
    dv = ((right + left) / r + lever * w * w) / (
        base.mass + 2 * inertia_wheel / r**2
    )
    dw = (b / (2 * r) * (right - left) - lever * w * v) / (
        base.inertia + b**2 / (2 * r**2) * inertia_wheel
    )
    return dv, dw


# Kinematics


def test_wheels_that_turn_alike_drive_straight():
    np.testing.assert_allclose(ROUND.body_velocity(5, 5), [0.5, 0])


def test_wheels_that_turn_apart_turn_left_in_place():
    # The rims move 0.2 m/s each way, 0.2 m from the middle.
    np.testing.assert_allclose(ROUND.body_velocity(-2, 2), [0, 1])


def test_right_wheel_alone_turns_the_base_about_the_left_one():
    np.testing.assert_allclose(ROUND.body_velocity(0, 4), [0.2, 1])


def test_wheel_speeds_of_a_curve_are_worked_by_hand():
    # 0.5 m/s on a circle of 0.5 m to the left: rims 0.3 and 0.7 m/s.
    np.testing.assert_allclose(ROUND.wheel_speeds(0.5, 1.0), [3, 7])


@given(PAIR, st.floats(0.01, 1), st.floats(0.05, 2))
def test_wheel_speeds_and_body_velocity_undo_each_other(pair, radius, track):
    base = DifferentialDrive(wheel_radius=radius, track=track)
    np.testing.assert_allclose(
        base.body_velocity(*base.wheel_speeds(*pair)), pair, atol=1e-12
    )
    np.testing.assert_allclose(
        base.wheel_speeds(*base.body_velocity(*pair)), pair, atol=1e-12
    )


def test_velocities_in_a_batch_are_those_one_by_one():
    batch = np.arange(12.0).reshape(2, 2, 3)
    speeds = np.array(ROUND.wheel_speeds(*batch))
    velocities = np.array(ROUND.body_velocity(*batch))
    for i in np.ndindex(2, 3):
        pair = batch[:, *i]
        np.testing.assert_allclose(speeds[:, *i], ROUND.wheel_speeds(*pair))
        np.testing.assert_allclose(
            velocities[:, *i], ROUND.body_velocity(*pair)
        )


# Figures


def test_masses_are_those_of_the_plant(stowed):
    plant, context = stowed
    wheels = sum(
        plant.GetBodyByName(name).get_mass(context)
        for name in ("wheel_left", "wheel_right")
    )
    total = plant.CalcTotalMass(context)
    base = DifferentialDrive()
    assert base.mass == pytest.approx(total, abs=1e-4)
    assert base.body_mass == pytest.approx(total - wheels, abs=1e-4)


def test_centre_of_mass_and_inertia_are_those_of_the_plant(stowed):
    plant, context = stowed
    bodies = [BodyIndex(i) for i in range(1, plant.num_bodies())]
    rest = [
        i
        for i in bodies
        if plant.get_body(i).name() not in ("wheel_left", "wheel_right")
    ]
    frame = plant.GetFrameByName("base")
    everything = plant.CalcSpatialInertia(context, frame, bodies)
    without_wheels = plant.CalcSpatialInertia(context, frame, rest)
    base = DifferentialDrive()
    assert base.com_offset == pytest.approx(
        without_wheels.get_com()[0], abs=1e-5
    )
    assert base.inertia == pytest.approx(
        everything.CalcRotationalInertia().get_moments()[2], abs=1e-4
    )


def test_wheels_figures_and_limits_are_those_of_the_plant(stowed):
    plant, context = stowed
    base = DifferentialDrive()
    left, right = (
        plant.GetJointByName(name) for name in ("wheel_left", "wheel_right")
    )
    p_left, p_right = (
        joint.frame_on_parent()
        .CalcPose(context, plant.GetFrameByName("base"))
        .translation()
        for joint in (left, right)
    )
    assert base.track == pytest.approx(p_left[1] - p_right[1])
    # The wheels' lowest points are on the ground, z = 0.
    assert base.wheel_radius == pytest.approx(p_left[2])
    for joint in (left, right):
        wheel = joint.child_body()
        inertia = wheel.default_rotational_inertia().get_moments()
        assert base.wheel_inertia == pytest.approx(inertia[1])
        assert base.wheel_speed_limit == joint.velocity_upper_limits()[0]
        assert (
            base.wheel_acceleration_limit
            == joint.acceleration_upper_limits()[0]
        )
        actuator = plant.GetJointActuatorByName(joint.name())
        assert base.wheel_torque_limit == actuator.effort_limit()


@pytest.mark.parametrize(
    "name",
    [
        "wheel_radius",
        "track",
        "mass",
        "body_mass",
        "inertia",
        "wheel_inertia",
        "wheel_speed_limit",
        "wheel_acceleration_limit",
        "wheel_torque_limit",
    ],
)
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_figure_out_of_range_is_refused_by_name(name, value):
    assert_refused(name, DifferentialDrive, **{name: value})


# Dynamics


def test_no_torque_is_needed_to_stand_or_to_roll_straight():
    base = DifferentialDrive()
    np.testing.assert_array_equal(base.wheel_torques([0, 0], [0, 0]), [0, 0])
    np.testing.assert_array_equal(base.wheel_torques([1, 0], [0, 0]), [0, 0])


def test_torques_of_a_start_and_of_a_turn_are_worked_by_hand():
    base = HAND_WORKED
    # 30 + 2 kg at 0.5 m/s^2: 16 N, or 1.6 N m, shared by two wheels.
    np.testing.assert_allclose(base.wheel_torques([0, 0], [0.5, 0]), [0.8, 0.8])
    # 1 + 0.08 kg m^2 at 2 rad/s^2: 2.16 N m; 5.4 N at each rim.
    np.testing.assert_allclose(
        base.wheel_torques([0, 0], [0, 2.0]), [-0.54, 0.54]
    )
    # Turning steadily with the mass ahead: it pulls forward with
    # 20 * 0.1 * 3^2 = 18 N, and at 1 m/s turns back with 6 N m: 15 N a rim.
    np.testing.assert_allclose(
        base.wheel_torques([1, 3], [0, 0]), [-0.9 - 1.5, -0.9 + 1.5]
    )


@given(PAIR, PAIR, st.floats(-0.2, 0.2))
def test_torques_give_the_acceleration_that_they_were_asked_for(
    velocity, wanted, offset
):
    base = DifferentialDrive(com_offset=offset)
    torques = base.wheel_torques(velocity, wanted)
    np.testing.assert_allclose(
        acceleration(base, torques, *velocity), wanted, atol=1e-9
    )


@given(PAIR, PAIR)
def test_power_of_the_torques_is_the_change_of_the_kinetic_energy(
    velocity, change
):
    # Of a body whose centre of mass moves with (v, d w): the energy is
    # (m v^2 + I w^2 + I_w (left^2 + right^2)) / 2.
    base = DifferentialDrive(com_offset=0.15)

    def energy(v, w):
        rims = [(v - w * base.track / 2), (v + w * base.track / 2)]
        spin = np.square(np.array(rims) / base.wheel_radius).sum()
        return 0.5 * (
            base.mass * v**2 + base.inertia * w**2 + base.wheel_inertia * spin
        )

    velocity, change = np.array(velocity), np.array(change)
    step = 1e-4
    rate = (
        energy(*(velocity + step * change))
        - energy(*(velocity - step * change))
    ) / (2 * step)
    power = np.dot(
        base.wheel_torques(velocity, change), base.wheel_speeds(*velocity)
    )
    assert power == pytest.approx(rate, abs=1e-5)


@settings(max_examples=30)
@given(PAIR, PAIR)
def test_torques_are_those_of_the_plant_rolling_without_slip(
    stowed, velocity, wanted
):
    """Drake's inverse dynamics, projected on the motions (v, w)."""
    plant, context = stowed
    (v, w), (dv, dw) = velocity, wanted
    base = DifferentialDrive()
    wheels = [
        plant.GetJointByName(name).velocity_start()
        for name in ("wheel_left", "wheel_right")
    ]
    # Generalised velocities of the base: w_WB, then v_WB, in W.
    S = np.zeros((plant.num_velocities(), 2))
    S[3, 0] = S[2, 1] = 1.0
    S[wheels, 0] = 1 / base.wheel_radius
    S[wheels, 1] = np.array([-1, 1]) * base.track / 2 / base.wheel_radius
    rates = S @ [dv, dw]
    rates[4] += v * w  # The velocity turns with the base.
    plant.SetVelocities(context, S @ [v, w])
    forces = plant.CalcInverseDynamics(context, rates, MultibodyForces(plant))
    torques = np.linalg.solve(S[wheels].T, S.T @ forces)
    np.testing.assert_allclose(
        base.wheel_torques(velocity, wanted), torques, atol=2e-3
    )


@pytest.mark.parametrize("wanted", [(0.6, 0.0), (0.0, 1.5), (0.5, -1.0)])
def test_plant_on_the_ground_speeds_up_as_the_torques_ask(wanted):
    diagram, plant = add_robot(0.002, ground=True)
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    set_arm(plant, context, STOWED)
    for name in ARM_JOINTS:
        plant.GetJointByName(name).Lock(context)
    torques = DifferentialDrive().wheel_torques([0, 0], wanted)
    names = ["wheel_left", "wheel_right"]
    actuation = np.zeros(plant.num_actuators())
    for name, torque in zip(names, torques, strict=True):
        actuation[plant.GetJointActuatorByName(name).input_start()] = torque
    port = plant.get_actuation_input_port()
    body = plant.GetBodyByName("base")
    # First let it settle on its wheels and rock.
    port.FixValue(context, np.zeros(len(actuation)))
    simulator.AdvanceTo(0.2)
    port.FixValue(context, actuation)
    speeds = []
    for time in (0.4, 0.6):
        simulator.AdvanceTo(time)
        V_WB = body.EvalSpatialVelocityInWorld(context)
        R_WB = body.EvalPoseInWorld(context).rotation()
        forward = (R_WB.inverse() @ V_WB.translational())[0]
        speeds.append([forward, V_WB.rotational()[2]])
    gained = (np.array(speeds[1]) - speeds[0]) / 0.2
    np.testing.assert_allclose(gained, wanted, rtol=0.03, atol=0.02)
