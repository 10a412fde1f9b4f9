"""What is wrong with images, joints, depths and beliefs of a run, and what moves on its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.actuation import Actuation
from robsim.analysis.case import Case, Repeated
from robsim.analysis.diagnosis import diagnosed
from robsim.analysis.explanation import views
from robsim.analysis.explanation.beliefs import false_beliefs
from robsim.analysis.explanation.removal import Removal, put
from robsim.analysis.explanation.wording import counted, length, listed, movers, number
from robsim.analysis.leaves import changed, leaves
from robsim.analysis.truth import true_features
from robsim.motion import Motion
from robsim.outcome import Outcome
from robsim.sensing import Sensing
from robsim.servo import DepthFilter

Told = tuple[str, dict[str, float]]  # a sentence and its numbers
Teller = Callable[[Repeated], Told]


def imperfections(again: Repeated) -> list[Removal]:
    """All that is wrong in a run, in the order in which it is put right."""
    return [
        *_of("sensing", Sensing(), SENSING, again),
        *_of("actuation", Actuation(), ACTUATION, again),
        *_depths(again),
        *false_beliefs(again.case),
        *_motions(again),
    ]


def _of(
    part: str, perfect: Any, table: dict[str, tuple[str, Teller]], again: Repeated
) -> Iterator[Removal]:
    given = getattr(again.case, part)
    for field, (name, tell) in table.items():
        value, right = getattr(given, field), getattr(perfect, field)
        if value != right and np.any(value):
            yield Removal(field, name, *_with(tell(again), put(part, **{field: right})))


def _with(told: Told, change: Any) -> tuple[str, Any, dict[str, float]]:
    return told[0], change, told[1]


def _noise(again: Repeated) -> Told:
    sigma = again.case.sensing.noise
    told, evidence = _floor(again, f"There is pixel noise of {number(sigma)} px")
    return told, {"noise_px": sigma, **evidence}


def _quantisation(again: Repeated) -> Told:
    step = again.case.sensing.quantisation
    told, evidence = _floor(again, f"Pixels are rounded to {number(step)} px")
    return told, {"quantisation_px": step, **evidence}


def _outliers(again: Repeated) -> Told:
    share, size = again.case.sensing.outliers, again.case.sensing.outlier_size
    sentence = (
        f"Outliers: {number(100 * share)} percent of the marks are seen about {number(size)} px "
        "from where they are."
    )
    return sentence, {"share": share, "outlier_px": size}


def _occlusions(again: Repeated) -> Told:
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


def _dropped(again: Repeated) -> Told:
    share = again.case.sensing.dropped
    return f"{number(100 * share)} percent of the images are lost.", {"share": share}


def _latency(again: Repeated) -> Told:
    case = again.case
    periods, gain = case.sensing.latency / case.dt, views.gain_of(case)
    limit, product = views.delay_limit(periods), views.gain_of(case) * case.dt
    told = f"The images are {number(case.sensing.latency)} s old, {_periods(periods)}"
    if product > limit:
        told += (
            f": with such a delay the loop is unstable where gain times period exceeds "
            f"{number(limit)}, and it is {number(product)}."
        )
    elif product <= limit:
        told += f"; gain times period is {number(product)}, and {number(limit)} is the limit."
    else:
        told += "."
    evidence = {"periods": periods, "gain_dt": product, "limit": limit, "gain": gain}
    return told, evidence


def _period(again: Repeated) -> Told:
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


def _lag(again: Repeated) -> Told:
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


def _velocity(again: Repeated) -> Told:
    return _cut(again, "velocity")


def _acceleration(again: Repeated) -> Told:
    return _cut(again, "acceleration")


def _cut(again: Repeated, which: str) -> Told:
    """How often the joints did not move as commanded."""
    columns, scene = again.loop.controller.columns, again.case.scene
    limit = again.case.actuation.limits(which, scene.nv)[columns]
    periods = max(len(again.moments) - 1, 1)
    wanted, actual = (again.run[name].values[:periods, columns] for name in ("qd", "qd_actual"))
    asked = wanted if which == "velocity" else (wanted - actual) / again.case.dt
    share = float((np.abs(asked) > limit).any(axis=1).mean())
    sentence = (
        f"The {which} limits of the joints change the command in {number(100 * share)} percent "
        "of the periods, and with it the direction of the motion."
    )
    return sentence, {"share": share}


def _encoder(again: Repeated) -> Told:
    step = float(np.max(again.case.actuation.encoder))
    told, evidence = _floor(again, f"The encoders count in steps of {number(step)} (rad or m)")
    return told, {"step": step, **evidence}


SENSING: dict[str, tuple[str, Teller]] = {
    "noise": ("pixel noise", _noise),
    "quantisation": ("rounded pixels", _quantisation),
    "outliers": ("outliers", _outliers),
    "occlusions": ("hidden marks", _occlusions),
    "dropped": ("lost images", _dropped),
    "latency": ("latency", _latency),
    "period": ("rare images", _period),
}
ACTUATION: dict[str, tuple[str, Teller]] = {
    "lag": ("the lag of the joints", _lag),
    "velocity": ("velocity limits", _velocity),
    "acceleration": ("acceleration limits", _acceleration),
    "encoder": ("coarse encoders", _encoder),
}


def _depths(again: Repeated) -> Iterator[Removal]:
    scales = {leaf.depth_scale for leaf in leaves(again.case.task)} - {1.0}
    if scales:
        told = _scaled(again, np.ravel(next(iter(scales))))
        change = _each_leaf(depth_scale=1.0)
        undone = "with the true depths"
        yield Removal("depth scale", "the wrong depths", *_with(told, change), undone)
    odd = [leaf.depth for leaf in leaves(again.case.task) if leaf.depth != "true"]
    if odd:
        depths = views.mean_depths(again)
        depths = depths[depths > 0] if (depths > 0).any() else depths
        low, high = float(depths.min()), float(depths.max())
        sentence = (
            f"The depth in L is {_said(odd[0])}, not the true one, which goes from {length(low)} "
            f"to {length(high)}."
        )
        change, evidence = _each_leaf(depth="true"), {"least_m": low, "most_m": high}
        undone = "with the true depth"
        yield Removal("depth", "the assumed depth", sentence, change, evidence, undone)


def _said(depth: Any) -> str:
    if isinstance(depth, DepthFilter):
        return "estimated by a filter"
    return "that of the goal" if depth == "goal" else f"taken as {length(depth)}"


def _scaled(again: Repeated, scale: Any) -> Told:
    low, high = float(np.min(scale)), float(np.max(scale))
    product = high * views.gain_of(again.case) * again.case.dt
    evidence = {"least": low, "most": high, "gain_dt": product, "limit": 2.0}
    if low == high:
        sentence = (
            f"The law takes all depths for {number(high)} times what they are, so that "
            f"translations are {number(high)} times as fast as they should be: gain times period "
            f"times that factor is {number(product)}, and the loop is "
            f"{'unstable from' if product > 2 else 'stable up to'} 2."
        )
        return sentence, evidence
    sentence = (
        f"The depths that the law assumes are wrong by factors from {number(low)} to "
        f"{number(high)}, not the same for all marks, to which the loop is sensitive (Malis and "
        "Rives 2003)"
    )
    slowest = diagnosed(again)["contraction"].values[-1]
    if not np.isfinite(slowest):
        return f"{sentence}.", evidence
    ideal = abs(1 - views.gain_of(again.case) * again.case.dt)
    sentence += (
        f": of the error of the motion that is served worst {100 * slowest:.4g} percent are left "
        f"after a period, where {100 * ideal:.4g} should be."
    )
    return sentence, evidence | {"contraction": float(slowest), "ideal": ideal}


def _motions(again: Repeated) -> Iterator[Removal]:
    scene = again.case.scene
    if not scene.motions:
        return
    names = listed([f"'{motion.robot}'" for motion in scene.motions])
    drift, gain = _drift(again), views.gain_of(again.case)
    known = any(leaf.feed_forward is not None for leaf in leaves(again.case.task))
    how = "and its feed-forward does not make up for it" if known else "and the law does not know"
    sentence = f"{movers(scene)}, {how}"
    if np.isfinite(drift / gain):
        sentence += (
            f": a law of gain {number(gain)} per second lags behind by about the drift of the "
            f"error over the gain, {number(drift)} / {number(gain)} = "
            f"{views.size(again, drift / gain)}"
        )
    still = [Motion(m.robot, np.zeros(scene.robot(m.robot).nv)) for m in scene.motions]
    evidence = {"drift": drift, "gain": gain, "lag": drift / gain}
    undone = f"with {names} standing still"
    yield Removal(
        "own motion", "what moves on its own", f"{sentence}.", _stands(still), evidence, undone
    )


def _stands(still: list[Motion]) -> Any:
    return lambda case: case.but(scene=case.scene.replacing(*still))


def _drift(again: Repeated) -> float:
    """How fast what moves on its own changes the error in the end: its largest, per second."""
    case, last = again.case, len(again.moments) - 1
    truth = true_features(case.task, case.scene, again.moments[last].q)
    if truth is None:
        return float("nan")
    own = case.scene.drift(last * case.dt)
    return float(np.abs(truth.rates[0] @ own).max())


def _floor(again: Repeated, what: str) -> Told:
    """Something that lets no error vanish, with the median of max|e| over the last third."""
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


def _each_leaf(**values: Any) -> Any:
    def change(case: Case) -> Case:
        return case.but(task=changed(case.task, lambda leaf: replace(leaf, **values)))

    return change
