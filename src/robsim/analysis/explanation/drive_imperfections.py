"""Imperfections of driven joints: limits of torques, friction, weight, models, and payloads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation.ablation import Ablation, ExperimentChange
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_list, format_number
from robsim.base.arrays import Array
from robsim.engine.driven_joints import DrivenJoints
from robsim.robot.joint import Joint
from robsim.run.experiment import Experiment
from robsim.world.drives.joint_drive import DriveModel
from robsim.world.drives.servo_loop import ServoLoop

AT_REST = 1e-9  # speed below which a joint rests, in rad/s or m/s


def list_drive_imperfections(analysis: RunAnalysis) -> Iterator[Ablation]:
    """Yield the imperfections of the driven joints of a run; none without a drive."""
    joints = analysis.loop.driven
    if joints is None:
        return
    yield from _list_torque_limits(analysis, joints)
    yield from _list_friction(analysis, joints)
    yield from _list_missing_gravity(joints)
    yield from _list_model_errors(joints)
    yield from _list_unknown_payloads(joints)


def measure_saturation(analysis: RunAnalysis, joints: DrivenJoints) -> Array:
    """Return the share of the run in which the torque of each joint (m,) was limited."""
    last = analysis.history.length
    shares = analysis.run["saturation"].values[1:last, joints.velocities]
    return np.asarray(shares.mean(axis=0)) if len(shares) else np.zeros(len(joints.names))


def measure_sticking(analysis: RunAnalysis, joints: DrivenJoints) -> Array:
    """Return the share of the run in which each joint (m,) rested against its command."""
    last = analysis.history.length
    columns = analysis.controller.columns.tolist()
    commands = np.zeros((last, analysis.case.scene.nv))
    commands[:, columns] = analysis.run["qd"].values[:last]
    v = analysis.run["qd_actual"].values[:last]
    rests = (np.abs(v) < AT_REST) & (np.abs(commands) > AT_REST)
    return np.asarray(rests[1:, joints.velocities].mean(axis=0)) if last > 1 else 0.0 * v[0]


def describe_saturation(analysis: RunAnalysis, joints: DrivenJoints) -> tuple[str, float] | None:
    """Return the sentence on limited torques, and the largest share; None without saturation."""
    shares, unit = measure_saturation(analysis, joints), _torque_units(joints)
    acting = np.flatnonzero(shares)
    if not acting.size:
        return None
    each = [
        f"'{joints.names[j]}' at {format_number(float(joints.limits[j]))} {unit[j]} for "
        f"{format_number(100 * float(shares[j]))} % of the run"
        for j in acting[np.argsort(-shares[acting])]
    ]
    return f"The torques of drives were limited: {format_list(each)}.", float(shares.max())


def _list_torque_limits(analysis: RunAnalysis, joints: DrivenJoints) -> Iterator[Ablation]:
    """Yield the limits of torques that acted."""
    stated = describe_saturation(analysis, joints)
    if stated is not None:
        sentence, share = stated
        evidence = {"saturated": share}
        phrase = "without limits of torques"
        yield Ablation(
            "saturation", "the limits of torques", sentence, remove_torque_limits, evidence, phrase
        )


def _list_friction(analysis: RunAnalysis, joints: DrivenJoints) -> Iterator[Ablation]:
    """Yield the Coulomb friction of the joints."""
    friction = joints.numbers("friction")
    acting = np.flatnonzero(friction)
    if not acting.size:
        return
    sticking, unit = measure_sticking(analysis, joints), _torque_units(joints)
    each = [f"'{joints.names[j]}' with {format_number(friction[j])} {unit[j]}" for j in acting]
    sentence = f"Friction holds {format_list(each)}"
    j = int(np.argmax(sticking))
    if sticking[j]:
        share = format_number(100 * float(sticking[j]))
        sentence += f"; '{joints.names[j]}' rested against its command for {share} % of the run"
    evidence = {"friction": float(friction.max()), "at_rest": float(sticking.max())}
    yield Ablation(
        "friction", "friction", f"{sentence}.", remove_friction, evidence, "without friction"
    )


def _list_missing_gravity(joints: DrivenJoints) -> Iterator[Ablation]:
    """Yield the weight that a drive does not compensate."""
    drive: Any = joints.drive
    if getattr(drive, "gravity", True):
        return
    sentence = (
        f"{drive.label} does not compensate the weight of the links, which its loops must hold"
    )
    change = _change_drive(lambda own: replace(own, gravity=True))
    phrase = "with gravity compensation"
    yield Ablation("gravity", "the weight of the links", f"{sentence}.", change, {}, phrase)


def _list_model_errors(joints: DrivenJoints) -> Iterator[Ablation]:
    """Yield wrong masses and a wrong gravity in the model of a drive."""
    drive = joints.drive
    if isinstance(drive, ServoLoop) or hasattr(drive, "gravity"):
        for name, noun in (("mass", "masses"), ("gravity", "gravity")):
            share = float(np.reshape(getattr(drive.model, name), -1)[0])
            if share == 1.0:
                continue
            sentence = (
                f"The model of {drive.label} has {format_number(100 * share)} % of the true {noun}."
            )
            change = _change_model(**{name: 1.0})
            about = f"drive.model.{name}"
            phrase = f"with the true {noun} in the model"
            yield Ablation(
                about, f"the {noun} of the model", sentence, change, {name: share}, phrase
            )


def _list_unknown_payloads(joints: DrivenJoints) -> Iterator[Ablation]:
    """Yield the payloads that a drive does not know."""
    if not joints.loads or joints.drive.model.payload:
        return
    each = [
        f"{format_number(float(np.reshape(load.mass, -1)[0]))} kg on '{load.on}'"
        for load in joints.loads
    ]
    sentence = f"{joints.drive.label} does not know the payload of {format_list(each)}."
    evidence = {"mass": float(sum(np.reshape(load.mass, -1)[0] for load in joints.loads))}
    change, phrase = _change_model(payload=True), "with a model that knows the payload"
    if not _uses_model(joints):
        change, phrase = remove_payloads, "without the payload"
    yield Ablation("payload", "the unknown payload", sentence, change, evidence, phrase)


def _uses_model(joints: DrivenJoints) -> bool:
    """Return whether a drive computes torques by its model."""
    drive: Any = joints.drive
    own = getattr(drive, "has_gravity", getattr(drive, "gravity", False))
    return bool(getattr(drive, "is_inverse", False) or own)


def remove_torque_limits(case: Experiment) -> Experiment:
    """Return the case without limits of torques."""
    changed = replace_joints(case, lambda joint: replace(joint, effort=None))
    if getattr(case.actuation.drive, "torque_limit", None) is None:
        return changed
    return _change_drive(lambda own: replace(own, torque_limit=None))(changed)


def remove_friction(case: Experiment) -> Experiment:
    """Return the case without Coulomb friction."""
    return replace_joints(case, lambda joint: replace(joint, friction=0.0))


def remove_payloads(case: Experiment) -> Experiment:
    """Return the case without payloads."""
    return case.with_(actuation=replace(case.actuation, payloads=()))


def remove_drive(case: Experiment) -> Experiment:
    """Return the case with joints that follow their commands exactly."""
    return case.with_(actuation=replace(case.actuation, drive=None, payloads=()))


def replace_joints(case: Experiment, change: Callable[[Joint], Joint]) -> Experiment:
    """Return the case with other joints."""
    robots = [
        replace(robot, links=tuple(replace(link, joint=change(link.joint)) for link in robot.links))
        for robot in case.scene.robots
    ]
    return case.with_(scene=case.scene.replacing(*robots))


def _change_drive(change: Callable[[Any], Any]) -> ExperimentChange:
    """Return the change of an experiment that changes its drive."""

    def change_case(case: Experiment) -> Experiment:
        drive = change(case.actuation.drive)
        return case.with_(actuation=replace(case.actuation, drive=drive))

    return change_case


def _change_model(**values: Any) -> ExperimentChange:
    """Return the change of an experiment that changes the model of its drive."""

    def change(drive: Any) -> Any:
        model: DriveModel = replace(drive.model, **values)
        return replace(drive, model=model)

    return _change_drive(change)


def _torque_units(joints: DrivenJoints) -> list[str]:
    """Return the units of the torques of the joints."""
    return ["N" if each.joint.kind == "prismatic" else "N m" for each in joints.joints]
