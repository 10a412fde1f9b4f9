"""Schemes alone and within constraints: arrivals, paths, and the motion inside each period.

    python benchmarks/constraints.py vit_500 large_rolls          # PBVS and IBVS, field of view
    python benchmarks/constraints.py near_limits --joints         # and limits of joints
    python benchmarks/constraints.py near_limits --joints --schemes "PBVS;IBVS, L mean" --every 5
    python benchmarks/constraints.py panda ur5e puma560 --joints --starts 4000   # arms

Each scheme runs alone, within a `Safety` of the same numbers, and within the constraints. Every
period is looked at in ten instants: joints move at constant velocity, a flying camera along a
constant twist. An excess of the margin counts beyond the excess of the start.
"""

import argparse
import time
import warnings
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pandas as pd

import robsim as rs
from robsim.run.batch_numbers import BatchTemplate
from robsim.servo.camera_target import CameraTarget
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.published import near_limits
from robsim.suites.published.large_rolls import sees_marks
from robsim.suites.suite_registry import list_suites, load_suite
from robsim.suites.suite_trial import Trial

C = rs.constraints
SCHEMES = {
    "PBVS": rs.PBVS(),
    "IBVS, L current": rs.IBVS(),
    "IBVS, L mean": rs.IBVS(interaction="mean"),
    "IBVS, L desired": rs.IBVS(interaction="desired"),
}
INSTANTS = 10  # in each period
MARGIN = 8.0  # pixels
FROM_LIMIT, SPEED, ACCELERATION = 0.01, 2.0, 8.0  # of joints, rad, rad/s, rad/s^2
JOINTS = C.JointLimits(FROM_LIMIT), C.JointSpeeds(SPEED), C.JointAccelerations(ACCELERATION)


def take_runs(suite, runs):
    """Return a suite with some of its runs."""
    return replace(
        suite,
        starts=np.asarray(suite.starts)[runs],
        varied={name: np.asarray(values)[runs] for name, values in suite.varied.items()},
        groups={name: [labels[i] for i in runs] for name, labels in suite.groups.items()},
        draws=None if suite.draws is None else np.asarray(suite.draws)[runs],
        columns={name: np.asarray(values)[runs] for name, values in suite.columns.items()},
    )


def make_arm_suite(name, starts):
    """Return a suite like `near_limits` with another arm of the library and more starts."""
    arm = getattr(rs.robots, name)()
    K = [[near_limits.FOCAL, 0, 319.5], [0, near_limits.FOCAL, 239.5], [0, 0, 1]]
    eye = rs.MountedCamera("eye", rs.Camera(K, size=(640, 480)), on=f"{name}.{arm.tip}")
    base = near_limits.suite()
    T = rs.Pose(rs.Scene([arm], [], [eye]).pose("eye", arm.home).matrix)
    pose = T @ rs.Pose.at(0, 0, near_limits.DISTANCE)
    scene = rs.Scene(
        [arm], [rs.Object("square", marks=base.scene.object().marks, pose=pose)], [eye]
    )
    low, high = np.nan_to_num(scene.limits.T, posinf=np.inf, neginf=-np.inf)
    chosen, seed = np.empty((0, scene.nq)), 0
    while len(chosen) < starts:
        spread = near_limits.SPREAD * (2.0 * uniform(seed, SUITES, 20_000, scene.nq) - 1.0)
        q = scene.home + spread
        q = q[((q > low + 0.02) & (q < high - 0.02)).all(axis=1)]
        chosen, seed = np.concatenate([chosen, q[sees_marks(scene, q)]]), seed + 1
    return replace(base, name=name, scene=scene, goal=scene.home, starts=chosen[:starts])


@dataclass
class Excess:
    """Largest excess over each limit inside all periods; negative is room."""

    joints: float = -np.inf
    speeds: float = -np.inf
    accelerations: float = -np.inf
    border: float = -np.inf
    margin: float = -np.inf
    runs: int = 0

    def add(self, rows, other):
        """Add the runs of a scheme and the excess of its periods."""
        if other is not None:
            self.runs += len(rows)
            limits = "joints", "speeds", "accelerations", "border", "margin"
            self.raise_to(**{name: getattr(other, name) for name in limits})

    def __str__(self):
        return (
            f"border {self.border:.3g} px, margin {self.margin:.3g} px, joints {self.joints:.3g}, "
            f"speeds {self.speeds:.3g}, accelerations {self.accelerations:.3g}"
        )

    def raise_to(self, **values):
        """Keep the larger of the old and the new values."""
        for name, value in values.items():
            if np.size(value):
                setattr(self, name, max(getattr(self, name), float(np.nanmax(value))))


def measure_joints(excess, scene, q, qd, dt):
    """Measure joints, speeds and accelerations of a run, q (T, nq) and qd (T, n)."""
    before = np.vstack([np.zeros(qd.shape[1]), qd[:-1]])
    excess.raise_to(
        speeds=np.abs(qd) - SPEED, accelerations=np.abs(qd - before) / dt - ACCELERATION
    )
    low, high = scene.limits.T
    excess.raise_to(joints=np.maximum(low + FROM_LIMIT - q, q - high + FROM_LIMIT))


def measure_image(excess, sight, inside, runs):
    """Measure the image at coordinates inside (nq, B) of one run, the start first."""
    view = sight.project(inside, runs)
    size = np.array(sight.eye.camera.size)[:, None]
    room = np.minimum(view.pixels + 0.5, size - 0.5 - view.pixels)  # (N, 2, B)
    allowed = np.minimum(room[..., :1], MARGIN)
    excess.raise_to(border=-room, margin=allowed - room)


def flow_inside(scene, q, v, dt):
    """Return coordinates (nq, T * INSTANTS + 1): the start, and ten instants of each period."""
    each = [q[:1].T]
    for share in np.arange(1, INSTANTS + 1) / INSTANTS:
        moved = np.ascontiguousarray(q.T)
        scene.tree.flow(moved, np.ascontiguousarray(v.T), share * dt)
        each.append(moved)
    return np.concatenate(each, axis=1)


def measure_periods(excess, experiment, run):
    """Measure all periods of the runs of a chunk."""
    scene = experiment.scene
    if experiment.varied:
        scene = BatchTemplate(experiment).of(experiment.varied).scene
    sight = CameraTarget(scene, scene.camera(), scene.object())
    columns = sight.columns
    for i in range(run.sizes["run"]):
        q, qd = run.q.values[i], run.qd.values[i]
        going = np.isfinite(qd).all(axis=1) & np.isfinite(q).all(axis=1)
        q, qd = q[going][:-1], qd[going][:-1]  # the last command is never executed
        if not len(q):
            continue
        v = np.zeros((len(q), scene.nv))
        v[:, columns] = qd
        inside = flow_inside(scene, q, v, experiment.dt)
        runs = np.full(inside.shape[1], i) if experiment.varied else np.zeros(inside.shape[1], int)
        measure_image(excess, sight, inside, runs)
        measure_joints(excess, scene, inside[:, 1:].T, qd, experiment.dt)


def run_scheme(suite, task, chunk, safety=None, counted=False, looks=False):
    """Return rows of all runs, infeasible and active instants, and the excess inside periods."""
    excess, parts, counts = Excess(), [], np.zeros(3, dtype=int)
    for first in range(0, suite.runs, chunk):
        part = take_runs(suite, np.arange(first, min(first + chunk, suite.runs)))
        (experiment,) = Trial(part, "scheme", task, {}).experiments
        if safety is not None:
            experiment = experiment.with_(safety=safety)
        run = experiment.with_(record="all" if counted else "summary").run(threads=2)
        rows = {name: run[name].values for name in ("outcome", "path_length", "end_time")}
        rows["distance_to_goal"], rows["angle_to_goal"] = part.off_goal(run.q_end.values)
        at = part.off_goal(np.asarray(part.starts))
        rows["distance_at_start"], rows["angle_at_start"] = at
        rows["began"] = rows["end_time"] > 0.0
        rows = pd.DataFrame({**rows, **part.columns})
        rows["success"] = np.asarray(suite.succeeds(rows)) & rows["began"]
        parts.append(rows)
        if looks:
            measure_periods(excess, experiment, run)
        if counted:
            going = np.isfinite(run.qd.values).all(axis=2)
            counts += (
                going.sum(),
                (going & (run.slack.values > 1e-9).any(axis=2)).sum(),
                (going & (run.active.values > 0.0).any(axis=2)).sum(),
            )
    return pd.concat(parts, ignore_index=True), counts, excess


def describe(name, rows, plain, counts, excess, seconds):
    """Return the line of a scheme."""
    both = rows["success"] & plain["success"]
    ratio = rows["path_length"][both] / plain["path_length"][both]
    total = rows["path_length"][both].sum() / plain["path_length"][both].sum() - 1
    line = f"  {name:36s} {rows['success'].sum():5d} of {rows['began'].sum()}"
    line += f"  path {100 * total:+5.1f} % (median {100 * (ratio.median() - 1):+.1f})"
    if counts[0]:
        line += f"  infeasible {counts[1]} of {counts[0]}, active {counts[2]}"
    if np.isfinite(excess.border):
        line += f"\n  {'':36s} excess: {excess}"
    lost = rows[rows["began"] & ~rows["success"]]["outcome"]
    if len(lost):
        ends = lost.map(lambda each: rs.Outcome(int(each)).name).value_counts().to_dict()
        line += f"\n  {'':36s} fails: {ends}, runs {list(lost.index[:8])}"
    return f"{line}  [{seconds:.1f} s]"


def main():
    """Print the table of each suite."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("suites", nargs="+")
    parser.add_argument("--joints", action="store_true", help="with limits of joints")
    parser.add_argument("--no-view", action="store_true", help="without the field of view")
    parser.add_argument("--no-looks", action="store_true", help="skip the instants inside periods")
    parser.add_argument("--safety", action="store_true", help="with the schemes within a Safety")
    parser.add_argument("--metric", default="error")
    parser.add_argument("--weight", type=float, default=1e-4, help="joint_weight of the law")
    parser.add_argument("--schemes", default="PBVS")
    parser.add_argument("--every", type=int, default=1, help="take every so many starts")
    parser.add_argument("--starts", type=int, default=500, help="starts of an arm of the library")
    parser.add_argument("--chunk", type=int, default=100)
    parser.add_argument("--gains", default="1", help="factors of the gain, as in 0.5,1,2")
    parser.add_argument("--periods", default="1", help="factors of the control period")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    view = [] if options.no_view else [C.FieldOfView(MARGIN), C.MarkDepth()]
    constraints = [*view, *(JOINTS if options.joints else ())]
    total = Excess()
    for name, gain, period in product(
        options.suites, options.gains.split(","), options.periods.split(",")
    ):
        is_suite = name in list_suites()
        suite = load_suite(name) if is_suite else make_arm_suite(name, options.starts)
        suite = take_runs(suite, np.arange(0, suite.runs, options.every))
        suite = replace(suite, gain=float(gain) * suite.gain, dt=float(period) * suite.dt)
        print(f"{name}: {suite.runs} starts, gain {suite.gain:g}, {suite.dt:g} s", flush=True)
        for scheme in options.schemes.split(";"):
            task = replace(SCHEMES[scheme], goal=suite.task_goal, gain=suite.gain)
            law = rs.laws.ConstrainedLaw(
                constraints, metric=options.metric, joint_weight=options.weight
            )
            variants = {f"{scheme}": (task, None)}
            if options.safety:
                variants[f"{scheme}, Safety"] = (
                    task,
                    rs.Safety(speed=SPEED, acceleration=ACCELERATION, margin=FROM_LIMIT),
                )
            variants[f"{scheme}, constraints"] = (replace(task, law=law), None)
            plain = None
            for label, (one, safety) in variants.items():
                began = time.process_time()
                counted = one is not task
                each = options.chunk, safety, counted, counted and not options.no_looks
                rows, counts, excess = run_scheme(suite, one, *each)
                plain = rows if plain is None else plain
                total.add(rows, excess if counted else None)
                took = time.process_time() - began
                print(describe(label, rows, plain, counts, excess, took), flush=True)
    print(f"{total.runs} runs within constraints, largest excess: {total}")


if __name__ == "__main__":
    main()
