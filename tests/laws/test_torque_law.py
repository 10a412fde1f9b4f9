"""The law of torques: its formula, its energy, what it refuses, and the controller on its own."""

from itertools import pairwise

import numpy as np
import pytest
from planar_arm import CASES, GOAL, PLANAR, TIMES, build_scene, build_task, place_camera

import robsim as rs
from robsim.base.errors import InputError
from robsim.laws import ControlState, TorqueLaw

LAWS = TorqueLaw(3.0), TorqueLaw(3.0, saturation=0.2)
STATE = np.array([0.1, 0.3])


def find_pixels(point):
    """The pixels of the tip at a normalised image point."""
    return (place_camera(0.0).camera.K[:2, :2] @ point + 400.0)[None]


def states(runs, k=5, n=4, gain=0.7):
    """A batch of states, and its single states."""
    draw = np.random.default_rng(7).normal
    parts = draw(size=(runs, k)), draw(size=(runs, k, 6)), draw(size=(runs, 6, n))
    each = [ControlState.of(*one, gain=gain) for one in zip(*parts, strict=True)]
    return ControlState.of(*parts, gain=gain), each


def pull(law, e):
    """The force of each component of an error."""
    w = law.saturation
    return law.stiffness * (e if w is None else w * np.tanh(e / w))


@pytest.mark.parametrize("law", LAWS)
def test_it_is_the_published_formula(law):
    batch, _ = states(9)
    expected = -0.7 * np.einsum("bkn,bk->bn", batch.task_jacobian, pull(law, batch.error))
    np.testing.assert_allclose(law.command(batch), expected, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("law", LAWS)
def test_a_run_alone_has_the_bits_of_its_batch(law):
    batch, each = states(11)
    whole = law.command(batch)
    for row, one in zip(whole, each, strict=True):
        np.testing.assert_array_equal(law.command(one)[0], row)


@pytest.mark.parametrize("law", LAWS)
def test_it_descends_its_potential_energy(law):
    """Central differences converge to the gradient with the second order."""
    e = np.array([0.3, -0.05, 0.8])
    errors = []
    for h in (1e-3, 5e-4):
        steps = h * np.eye(3)
        up, down = (law.potential_energy(e + s * steps, gain=0.7) for s in (1.0, -1.0))
        errors.append(np.abs((up - down) / (2 * h) - 0.7 * pull(law, e)).max())
    assert errors[0] < 1e-5
    if law.saturation:  # the other potential is quadratic
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.01)


def test_a_saturated_pull_has_a_bound_and_the_same_stiffness_at_the_goal():
    free, bounded = LAWS
    small = np.array([1e-5, -2e-5])
    np.testing.assert_allclose(
        bounded.potential_energy(small), free.potential_energy(small), rtol=1e-6
    )
    state = ControlState.of([1e6, -1e6], np.eye(2, 6), np.eye(6, 2))
    np.testing.assert_allclose(bounded.command(state), [[-0.6, 0.6]], rtol=1e-15)
    assert bounded.potential_energy([1e300]) == pytest.approx(0.6 * 1e300)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0.0,), "stiffness must be a positive number, got 0"),
        ((-1.0,), "stiffness must be a positive number"),
        ((1.0, 0.0), "saturation must be a positive number"),
        ((1.0, np.inf), "saturation"),
        (("stiff",), "stiffness: expected a number"),
    ],
)
def test_numbers_out_of_range_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        TorqueLaw(*arguments)


VELOCITIES = {
    "interaction": "broyden",
    "depth": rs.laws.DepthFilter(start=1.0),
    "feed_forward": "known",
    "limit": rs.laws.SpeedLimit(joint=1.0),
    "secondary": rs.laws.Posture([0.0, 0.0]),
    "gain": rs.laws.AdaptiveGain(4.0, 0.4, 30.0, of="command"),
}


@pytest.mark.parametrize("field", VELOCITIES)
def test_fields_of_velocities_are_refused_by_name(field):
    with pytest.raises(InputError, match=f"{field}: .* TorqueLaw commands torques: leave {field}"):
        rs.IBVS(GOAL, law="torque", **{field: VELOCITIES[field]})


@pytest.mark.parametrize("inverse", ["damped", "transpose"])
def test_an_inverse_is_refused(inverse):
    with pytest.raises(InputError, match="inverse: TorqueLaw uses the transpose"):
        rs.IBVS(GOAL, law="torque", inverse=inverse)


@pytest.mark.parametrize("wrap", [rs.laws.ConstrainedLaw, rs.laws.RolloutLaw])
def test_laws_of_velocities_refuse_it(wrap):
    inner = {"law": TorqueLaw()} if wrap is rs.laws.ConstrainedLaw else {"laws": [TorqueLaw()]}
    with pytest.raises(InputError, match=f"{wrap.__name__} needs a law of velocities, and Torque"):
        wrap(**inner)


def test_it_needs_a_drive_of_torques():
    with pytest.raises(InputError, match=r"commands torques, and the joints take velocities"):
        rs.simulate(build_scene(0.0), build_task(CASES["linear"]), STATE)


def test_tasks_of_one_scene_command_one_quantity():
    scene, law = build_scene(0.0), TorqueLaw(300.0)
    first, second = (rs.IBVS(GOAL, law=each) for each in (law, "joint"))
    task = rs.Switch(first, second, when=rs.tasks.ErrorBelow(0.01))
    with pytest.raises(InputError, match="one of the tasks commands torques and another"):
        rs.simulate(scene, task, STATE)
    both = rs.Switch(first, first, when=rs.tasks.ErrorBelow(0.01)).bind(scene)
    assert both.command_quantity == "torque"


def test_priorities_refuse_it():
    task = rs.IBVS(GOAL, law=TorqueLaw())
    with pytest.raises(InputError, match=r"priorities are for tasks .* with law='joint'"):
        rs.Priorities([task, task])


@pytest.mark.parametrize("limit", ["speed", "acceleration", "margin"])
def test_a_safety_of_velocities_is_refused(limit):
    made = rs.Experiment(
        build_scene(0.0), build_task(CASES["linear"]), STATE, safety=rs.Safety(**{limit: 0.1})
    )
    with pytest.raises(InputError, match=f"safety: {limit} limits velocities"):
        rs.Controller(made)


def test_a_linear_analysis_refuses_it():
    made = rs.Experiment(build_scene(0.0), build_task(CASES["linear"]), STATE)
    with pytest.raises(InputError, match="TorqueLaw commands torques"):
        rs.equilibria(made.scene, made.task)


def test_a_law_of_a_user_may_command_torques():
    class Spring:
        command_quantity = "torque"

        def command(self, state):
            return -5.0 * np.einsum("bkn,bk->bn", state.task_jacobian, state.error)

    scene, given = build_scene(0.0), TorqueLaw(5.0)
    each = [rs.Experiment(scene, rs.IBVS(GOAL, law=x), STATE, dt=1e-3) for x in (Spring(), given)]
    pixels = find_pixels([0.01, 0.25])
    torques = [rs.Controller(x).step(pixels, STATE, 0.0).torques for x in each]
    np.testing.assert_allclose(torques[0], torques[1], rtol=1e-13)
    Spring.command_quantity = "force"
    with pytest.raises(InputError, match="command_quantity: expected 'velocity' or 'torque'"):
        rs.Experiment(scene, rs.IBVS(GOAL, law=Spring()), STATE)


def swing(case, dt, periods):
    """Coordinates and velocities of the arm in closed form, driven by the controller's torques.

    A torque holds for a period, in which the arm with its damping and gravity moves by one step of
    the classic method of Runge and Kutta.
    """
    made = rs.Experiment(build_scene(case["roll"]), build_task(case), STATE, dt=dt, duration=2.0)
    controller = rs.Controller(made)
    x = np.concatenate([STATE, [0.0, 0.0]])
    for i in range(periods):
        s, _ = PLANAR["image"](x[:2], case["roll"])
        tau = controller.step(find_pixels(s), x[:2], i * dt).torques

        def rates(x, tau=tau):
            q, v = x[:2], x[2:]
            load = (case["share"] - 1.0) * PLANAR["weight"](q) - PLANAR["coriolis"](q, v)
            push = tau - PLANAR["DAMPING"] * v + load
            return np.concatenate([v, np.linalg.solve(PLANAR["inertia"](q), push)])

        a = rates(x)
        b = rates(x + 0.5 * dt * a)
        c = rates(x + 0.5 * dt * b)
        x = x + dt / 6.0 * (a + 2.0 * b + 2.0 * c + rates(x + dt * c))
    return x


@pytest.mark.parametrize("name", CASES)
def test_the_controller_drives_the_arm_as_in_closed_form(name):
    """The held torque is late by half a period: the difference is of the first order."""
    case, at = CASES[name], 3
    expected = np.concatenate([case["q"][at], case["v"][at]])
    away = []
    for dt in (2e-3, 1e-3):
        away.append(np.abs(swing(case, dt, round(TIMES[at] / dt)) - expected).max())
    assert away[1] < 0.03
    assert away[0] / away[1] == pytest.approx(2.0, rel=0.1)


def test_the_stored_energy_falls_by_the_work_of_the_damping():
    for name in ("linear", "rolled_camera", "saturated"):
        case, law = CASES[name], TorqueLaw(CASES[name]["stiffness"], CASES[name]["width"])
        goal, _ = PLANAR["image"](GOAL, case["roll"])
        for q, v, V in zip(case["q"], case["v"], case["energy"], strict=True):
            e = PLANAR["image"](q, case["roll"])[0] - goal
            kinetic = 0.5 * np.array(v) @ PLANAR["inertia"](q) @ v
            assert law.potential_energy(e) + kinetic == pytest.approx(V, abs=1e-12)
        assert all(a > b for a, b in pairwise(case["energy"]))
        np.testing.assert_allclose(np.add(case["energy"], case["lost"]), case["energy"][0])
