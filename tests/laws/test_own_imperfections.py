"""A compiled imperfection of one's own is one file with its kernel, and no other is touched."""

import sys

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.declare import families

SHAKE = '''
"""An image that shakes as a whole."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.declare import Number, PerRun, register
from robsim.kernels.formulas import random
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.array_views import unsigned_row
from robsim.kernels.machine.stages import stage
from robsim.world.imperfections.image_effect import ImageEffect


@stage
def shake(
    w, step, every="whole", N="count", pixels="N, 2", amplitude="row", seed="whole", run="row",
    stream="whole",
):
    """Move all marks together."""
    if step % every:
        return
    runs = unsigned_row(w, run)
    for b in range(WIDTH):
        dx, dy = random.normal_pair(np.uint64(seed), runs[b], step, stream, 0)
        size = w[amplitude * WIDTH + b]
        for n in range(N):
            w[(pixels + 2 * n) * WIDTH + b] += size * dx
            w[(pixels + 2 * n + 1) * WIDTH + b] += size * dy


@register("image effect", "shake")
@dataclass(frozen=True)
class Shake(ImageEffect):
    """An image that shakes as a whole."""

    title: ClassVar[str] = "shaking images"
    amplitude: Annotated[float, Number(least=0, unit="px"), PerRun(()), "In pixels."] = 1.0

    def add_stages(self, image):
        given = {"every": image.every, "pixels": image.own_pixels()}
        amplitude = image.program.number(self.amplitude)
        image.program.add(shake, **given, amplitude=amplitude, **image.key)

    def deviation(self, robust):
        return self.amplitude
'''
DEAD_ZONE = '''
"""Joints that stand still where they are commanded to move slowly."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import Number, PerRun, register
from robsim.kernels.machine.lanes import absolute, get, put, where
from robsim.kernels.machine.stages import stage
from robsim.world.imperfections.joint_effect import JointEffect


@stage
def stick(w, step, speed="row", velocities="each: row"):
    """Stop velocities that are slower than a speed."""
    for i in range(velocities[0]):
        v = get(w, velocities[1 + i])
        put(w, velocities[1 + i], where(absolute(v) < get(w, speed), 0.0 * v, v))


@register("joint effect", "dead_zone")
@dataclass(frozen=True)
class DeadZone(JointEffect):
    """Joints that stand still where they are commanded to move slowly."""

    title: ClassVar[str] = "the dead zone of the joints"
    below: Annotated[float, Number(least=0), PerRun(()), "Speed in rad/s or m/s."] = 0.01

    def add_stages(self, joints):
        rows = [joints.wanted[i] for i in joints.columns]
        joints.program.add(stick, speed=joints.program.number(self.below), velocities=rows)
'''


class ShakeInPython:
    def __init__(self, amplitude):
        self.amplitude = amplitude

    def seen(self, pixels, exposure):
        return pixels + self.amplitude * exposure.normal(1)


class DeadZoneInPython:
    def __init__(self, below):
        self.below = below

    def driven(self, wanted, drive):
        return np.where(np.abs(wanted) < self.below, 0.0, wanted)


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A package of its own with an imperfection of the images and one of the joints."""
    folder = tmp_path_factory.mktemp("package")
    (folder / "own_parts").mkdir()
    for name, text in (("__init__", ""), ("shake", SHAKE), ("dead_zone", DEAD_ZONE)):
        (folder / "own_parts" / f"{name}.py").write_text(text)
    sys.path.insert(0, str(folder))
    try:
        from own_parts.dead_zone import DeadZone
        from own_parts.shake import Shake

        yield Shake, DeadZone
    finally:
        sys.path.remove(str(folder))
        families()["image effect"].loaded.pop("shake", None)
        families()["joint effect"].loaded.pop("dead_zone", None)


@pytest.fixture
def experiment():
    return rs.load_scenario(examples.path("eye_in_hand")).with_(duration=2.0)


def shaken(experiment, *effects, **more):
    return experiment.with_(sensing=rs.Sensing(effects=effects, **more))


@pytest.mark.parametrize("more", [{}, {"noise": 0.5, "quantisation": 0.1, "latency": 0.05}])
def test_its_stage_gives_the_bits_of_numpy(own, experiment, more):
    Shake, DeadZone = own
    starts = experiment.start + 0.01 * np.arange(3)[:, None]
    compiled = shaken(experiment, Shake(0.5), **more).with_(start=starts)
    called = shaken(experiment, ShakeInPython(0.5), **more).with_(start=starts)
    for name in ("q", "s", "outcome"):
        found, wanted = compiled.run()[name].values, called.run()[name].values
        np.testing.assert_array_equal(found, wanted)
    assert compiled.loop().sequence.compiled and not called.loop().sequence.compiled
    sticky = experiment.with_(actuation=rs.Actuation(effects=DeadZone(0.02), lag=0.01))
    like = experiment.with_(actuation=rs.Actuation(effects=DeadZoneInPython(0.02), lag=0.01))
    np.testing.assert_array_equal(sticky.run().q.values, like.run().q.values)
    assert sticky.loop().sequence.compiled


def test_two_of_a_kind_have_random_numbers_of_their_own(own, experiment):
    """Independent shakes of 0.3 and 0.4 px are one of 0.5 px; the same one twice were 0.7 px."""
    Shake, _ = own
    run = shaken(experiment, Shake(3.0), Shake(4.0)).with_(duration=40.0, hold=True).run()
    task = experiment.task.bind(experiment.scene)
    true = run.pixels.values.reshape(len(run.time), -1)
    focal = experiment.scene.camera().camera.K[0, 0]
    assert task.units[0] == "1"
    center = experiment.scene.camera().camera.K[:2, 2]
    normalised = (true.reshape(len(true), -1, 2) - center) / focal
    off = (run.s.values.reshape(normalised.shape) - normalised)[:, 0] * focal
    assert off.std() == pytest.approx(5.0, rel=5 / np.sqrt(2 * off.size))


def test_a_file_sets_it_and_a_path_changes_it(own, experiment):
    Shake, DeadZone = own
    made = shaken(experiment, Shake(0.5)).with_(actuation=rs.Actuation(effects=DeadZone(0.02)))
    again = rs.Experiment.from_text(made.to_toml())
    assert again == made and 'kind = "shake"' in made.to_toml()
    changed = made.at({"sensing.effects.0.amplitude": 0.7, "actuation.effects.0.below": 0.03})
    assert changed.sensing == rs.Sensing(effects=Shake(0.7))
    assert changed.actuation == rs.Actuation(effects=DeadZone(0.03))
    with pytest.raises(rs.errors.InputError, match=r"effects.*amplitude.*must be.*, got -1"):
        made.at("sensing.effects.0.amplitude", -1.0)


def test_its_numbers_may_differ_from_run_to_run(own, experiment):
    Shake, DeadZone = own
    made = shaken(experiment, Shake(0.5)).with_(actuation=rs.Actuation(effects=DeadZone(0.02)))
    paths = {"sensing.effects.0.amplitude": [0.0, 0.5], "actuation.effects.0.below": [0.0, 0.1]}
    both = made.vary(paths).run()
    for i in range(2):
        one = made.at({name: numbers[i] for name, numbers in paths.items()})
        alone = one.with_(first_run=i).run()
        live = np.isfinite(alone.q.values[:, 0])
        np.testing.assert_array_equal(
            both.q.values[i][: len(live)][live], alone.q.values[live], err_msg=f"run {i}"
        )


def test_it_is_explained(own, experiment):
    Shake, DeadZone = own
    made = shaken(experiment, Shake(2.0)).with_(duration=20.0)
    run = made.run()
    assert run.outcome == rs.Outcome.TIME_LIMIT
    (cause, *_) = rs.explain(run, made).causes
    assert cause.about == "effects"
    assert cause.sentence.startswith("The images are changed by Shake: the largest error stays at")
    assert "Without shaking images, the same run converges" in cause.sentence
    explanation = rs.explain(run, made, trials=False)
    assert any("not examined: shaking images" in remark for remark in explanation.remarks)
    sticky = experiment.with_(actuation=rs.Actuation(effects=DeadZone(0.02)), duration=20.0)
    (cause, *_) = rs.explain(sticky.run(), sticky).causes
    assert "Without the dead zone of the joints, the same run converges" in cause.sentence


@pytest.mark.full
def test_advice_counts_it(own, experiment):
    """Noise of the same size on all marks alike is counted as noise of each."""
    Shake, DeadZone = own
    noisy = rs.advise(experiment.with_(sensing=rs.Sensing(noise=0.5)))
    shaky = rs.advise(shaken(experiment, Shake(0.3), Shake(0.4)))
    assert shaky.noise.pixels == pytest.approx(noisy.noise.pixels, rel=1e-12)
    assert shaky.notes == noisy.notes
    sticky = rs.advise(experiment.with_(actuation=rs.Actuation(effects=DeadZone())))
    assert "effects of your own are not considered" in sticky.notes


def test_kinds_of_the_short_form_are_effects_too(experiment):
    """Only their random numbers are others."""
    given = rs.Sensing(effects="latency", quantisation=0.5)
    short = rs.Sensing(latency=0.06, quantisation=0.5)
    runs = [experiment.with_(sensing=each).run() for each in (given, short)]
    np.testing.assert_array_equal(runs[0].q.values, runs[1].q.values)
    text = experiment.at("sensing.effects", [{"kind": "noise", "noise": 0.5}, {"kind": "dropped"}])
    assert text.sensing.timing(0.04) == rs.Sensing(dropped=0.1).timing(0.04)
    assert rs.Experiment.from_text(text.to_toml()) == text
    with pytest.raises(rs.errors.InputError, match="two lags of the joints; give one"):
        experiment.with_(actuation=rs.Actuation(lag=0.1, effects=["lag"])).run()
