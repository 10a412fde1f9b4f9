"""The imperfections of a run: in images, joints, depths and beliefs, and own motions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation import views
from robsim.analysis.explanation.beliefs import false_beliefs
from robsim.analysis.explanation.own_motion import own_motions
from robsim.analysis.explanation.removal import Removal, Statement, put
from robsim.analysis.explanation.safeties import safeties
from robsim.analysis.explanation.wording import counted, number
from robsim.analysis.explanation.wrong_depths import wrong_depths
from robsim.analysis.leaves import weighs_robustly
from robsim.analysis.repeated import Repeated
from robsim.engine.outcome import Outcome
from robsim.world.actuation import Actuation
from robsim.world.sensing import Sensing

Stating = Callable[[Repeated], Statement]


def imperfections(again: Repeated) -> list[Removal]:
    """Return every imperfection of a run, in the order in which they are removed."""
    return [
        *_of("sensing", Sensing(), SENSING, again),
        *_of("actuation", Actuation(), ACTUATION, again),
        *safeties(again),
        *wrong_depths(again),
        *false_beliefs(again.case),
        *own_motions(again),
    ]


def _of(
    part: str, perfect: Any, table: dict[str, tuple[str, Stating]], again: Repeated
) -> Iterator[Removal]:
    given = getattr(again.case, part)
    for field, (name, finding) in table.items():
        value, right = getattr(given, field), getattr(perfect, field)
        if value != right and np.any(value):
            sentence, evidence = finding(again)
            yield Removal(field, name, sentence, put(part, **{field: right}), evidence)


def _noise(again: Repeated) -> Statement:
    sigma = again.case.sensing.noise
    sentence, evidence = _floor(again, f"There is pixel noise of {number(sigma)} px")
    return sentence, {"noise_px": sigma, **evidence}


def _quantisation(again: Repeated) -> Statement:
    step = again.case.sensing.quantisation
    sentence, evidence = _floor(again, f"Pixels are rounded to {number(step)} px")
    return sentence, {"quantisation_px": step, **evidence}


def _outliers(again: Repeated) -> Statement:
    share, size = again.case.sensing.outliers, again.case.sensing.outlier_size
    sentence = (
        f"Outliers: {number(100 * share)} percent of the marks are seen about {number(size)} px "
        "from where they are"
    )
    robust = weighs_robustly(again.case.task)
    sentence += ", though robust weights are in use." if robust else "."
    return sentence, {"share": share, "outlier_px": size}


def _occlusions(again: Repeated) -> Statement:
    each = again.case.sensing.occlusions
    marks = sorted({mark for occlusion in each for mark in occlusion.marks})
    first, last = min(o.start for o in each), max(o.end for o in each)
    until = f"until {number(last)} s" if np.isfinite(last) else "on"
    sentence = (
        f"Mark{'s' * (len(marks) > 1)} {', '.join(map(str, marks))} "
        f"{'are' if len(marks) > 1 else 'is'} hidden from {number(first)} s {until}, and the law "
        "goes on without."
    )
    return sentence, {"marks": float(len(marks)), "start_s": first, "end_s": last}


def _dropped(again: Repeated) -> Statement:
    share = again.case.sensing.dropped
    return f"{number(100 * share)} percent of the images are lost.", {"share": share}


def _latency(again: Repeated) -> Statement:
    case = again.case
    periods, gain = case.sensing.latency / case.dt, views.gain_of(case)
    limit, product = views.delay_limit(periods), views.gain_of(case) * case.dt
    sentence = f"The images are {number(case.sensing.latency)} s old, {_periods(periods)}"
    if product > limit:
        sentence += (
            f": with such a delay the loop is unstable where gain times period exceeds "
            f"{number(limit)}, and it is {number(product)}."
        )
    elif product <= limit:
        sentence += f"; gain times period is {number(product)}, and {number(limit)} is the limit."
    else:
        sentence += "."
    evidence = {"periods": periods, "gain_dt": product, "limit": limit, "gain": gain}
    return sentence, evidence


def _period(again: Repeated) -> Statement:
    seconds = again.case.sensing.period or again.case.dt
    product = views.gain_of(again.case) * seconds
    sentence = (
        f"A new image comes every {number(seconds)} s only, {_periods(seconds / again.case.dt)}, "
        "and the command goes on meanwhile"
    )
    if np.isfinite(product):
        sentence += f": gain times {number(seconds)} s is {number(product)}, and from 2 on the loop"
        sentence += " is unstable"
    sentence += "."
    return sentence, {"period_s": seconds, "gain_period": product, "limit": 2.0}


def _lag(again: Repeated) -> Statement:
    lag, gain = again.case.actuation.lag, views.gain_of(again.case)
    damping = 0.5 / np.sqrt(lag * gain)
    sentence = f"The joints follow their command with a lag of {number(lag)} s"
    if np.isfinite(damping):
        sentence += (
            f": at a gain of {number(gain)} per second the damping ratio of the loop is "
            f"{number(damping)}, and below 1 it oscillates"
        )
    sentence += "."
    return sentence, {"lag_s": lag, "gain": gain, "damping": float(damping)}


def _velocity(again: Repeated) -> Statement:
    return _cut(again, "velocity")


def _acceleration(again: Repeated) -> Statement:
    return _cut(again, "acceleration")


def _cut(again: Repeated, which: str) -> Statement:
    """State how often a joint limit of this kind changed the command."""
    columns, scene = again.loop.controller.columns, again.case.scene
    limit = again.case.actuation.limits(which, scene.nv)[columns]
    periods = max(len(again.snapshots) - 1, 1)
    wanted, actual = (again.run[name].values[:periods, columns] for name in ("qd", "qd_actual"))
    asked = wanted if which == "velocity" else (wanted - actual) / again.case.dt
    share = float((np.abs(asked) > limit).any(axis=1).mean())
    sentence = (
        f"The {which} limits of the joints change the command in {number(100 * share)} percent "
        "of the periods, and with it the direction of the motion."
    )
    return sentence, {"share": share}


def _encoder(again: Repeated) -> Statement:
    step = float(np.max(again.case.actuation.encoder))
    sentence, evidence = _floor(again, f"The encoders count in steps of {number(step)} (rad or m)")
    return sentence, {"step": step, **evidence}


def _effects(again: Repeated) -> Statement:
    names = ", ".join(type(effect).__name__ for effect in again.case.sensing.effects)
    sentence, evidence = _floor(again, f"The images are changed by {names}")
    return sentence, evidence


def _joint_effects(again: Repeated) -> Statement:
    names = ", ".join(type(effect).__name__ for effect in again.case.actuation.effects)
    sentence, evidence = _floor(again, f"What is commanded is changed by {names}")
    return sentence, evidence


SENSING: dict[str, tuple[str, Stating]] = {
    "noise": ("pixel noise", _noise),
    "quantisation": ("rounded pixels", _quantisation),
    "outliers": ("outliers", _outliers),
    "occlusions": ("hidden marks", _occlusions),
    "dropped": ("lost images", _dropped),
    "latency": ("latency", _latency),
    "period": ("rare images", _period),
    "effects": ("effects on the images", _effects),
}
ACTUATION: dict[str, tuple[str, Stating]] = {
    "lag": ("the lag of the joints", _lag),
    "velocity": ("velocity limits", _velocity),
    "acceleration": ("acceleration limits", _acceleration),
    "encoder": ("coarse encoders", _encoder),
    "effects": ("effects on the joints", _joint_effects),
}


def _floor(again: Repeated, what: str) -> Statement:
    """State an imperfection that keeps the error from vanishing, with its final size."""
    if again.outcome is not Outcome.TIME_LIMIT:
        return f"{what}.", {}
    sizes, tolerance = views.largest_errors(again), again.loop.controller.tolerance
    floor = float(np.median(sizes[-max(len(sizes) // 3, 1) :]))
    sentence = (
        f"{what}: the largest error stays at about {views.size(again, floor)}, and the tolerance "
        f"is {views.size(again, tolerance)}."
    )
    return sentence, {"floor": floor, "tolerance": tolerance}


def _periods(count: float) -> str:
    if abs(count - round(count)) < 1e-6:
        return counted(round(count), "control period")
    return f"{number(count)} control periods"
