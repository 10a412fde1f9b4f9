"""The cost of runs with a calibration each, against runs with one (see README.md)."""

import time

import numpy as np

import robsim as rs

RUNS, STEPS, REPEATS = 10_000, 200, 5


def experiments():
    """Ten thousand starts with one wrong calibration, and with one for each, by scenario."""
    found = {}
    for name in ("eye_in_hand", "visp_tutorial"):
        experiment = rs.load_scenario(rs.examples.path(name))
        rng, eye = np.random.default_rng(1), experiment.scene.cameras[0]
        starts = experiment.start + 0.01 * rng.standard_normal((RUNS, len(experiment.start)))
        if experiment.scene.coordinate_units[-1] == "1":
            starts[:, 3:] /= np.linalg.norm(starts[:, 3:], axis=1, keepdims=True)
        camera = f"belief.cameras.{eye.name}"
        wrong = {
            f"{camera}.focal": eye.camera.K[0, 0] * rng.uniform(0.9, 1.1, RUNS),
            f"{camera}.rotvec": eye.pose.rotvec + 0.01 * rng.standard_normal((RUNS, 3)),
            f"{camera}.position": eye.pose.position + 0.01 * rng.standard_normal((RUNS, 3)),
        }
        told = {"record": "summary", "hold": True, "duration": STEPS * experiment.dt}
        one = experiment.with_(start=starts, **told)
        found[name] = one.at({key: values[0] for key, values in wrong.items()}), one.vary(wrong)
    return found


def measured():
    """Seconds of CPU of both, in turns, the least of some."""
    rows = {}
    for name, pair in experiments().items():
        turns = []
        for _ in range(REPEATS + 1):  # the first compiles
            turn = []
            for each in pair:
                start = time.process_time()
                each.run(threads=1)
                turn.append(time.process_time() - start)
            turns.append(turn)
        rows[name] = [min(column) for column in zip(*turns[1:], strict=True)]
    return rows


def main() -> None:
    """Print the table."""
    print(f"{RUNS} runs of {STEPS} steps       one calibration   one for each   ratio")
    for name, (one, each) in measured().items():
        print(f"{name:28} {one:13.2f} s {each:12.2f} s {each / one:7.2f}")


if __name__ == "__main__":
    main()
