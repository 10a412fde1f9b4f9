"""An inspection robot rolls along a cable and passes a spacer, guided by its camera (fig. 11)."""

from itertools import pairwise

import numpy as np

import robsim as rs
from robsim.plot import palette

UPRIGHT = rs.Pose.at(rpy=(np.pi / 2, 0, 0))  # the plane in which the cable hangs
LEVEL = rs.Pose.at(rpy=(-np.pi / 2, 0, 0))  # on the cable: x along it, y to the left, z up
SPACER, ASIDE = 8.0, 0.45  # metres along the cable; to the second cable, on the left
ARMS, RADIUS = 0.7, 0.05  # metres between the wheels, and of a wheel
APART = 0.18  # metres from the middle of the spacer to a wheel that opens or closes


def cable_of(robot):
    """The curve of the rail on which it rolls."""
    return next(link.joint.curve for link in robot.links if link.name == "rear")


def blocks(curve, first=2.0, last=16.0, long=0.25):
    """A cable 2 cm thick, whose top is the curve."""
    for a, b in pairwise(curve.at(np.arange(first, last, long)).position):
        way = np.arctan2(b[1] - a[1], b[0] - a[0])
        below = rs.Pose.at(*(a + b) / 2, rpy=(0, 0, way)) @ rs.Pose.at(0, -0.01, 0)
        yield rs.Block(np.hypot(*(b - a)[:2]), 0.02, 0.02, color="0.45").at(UPRIGHT @ below)


def eye_on(robot):
    """The camera of a robot."""
    camera = rs.Camera([[450, 0, 319.5], [0, 450, 239.5], [0, 0, 1]], size=(640, 480))
    return rs.MountedCamera("eye", camera, on=f"{robot.name}.camera_mount")


def scene():
    """The robot, two cables of a bundle, and the spacer that keeps them apart."""
    robot = rs.robots.load("inspection_a")
    clamp = rs.Block(0.12, 0.08, 0.10, color="y").at(rs.Pose.at(0, 0, -0.01))
    bar = rs.Block(0.06, ASIDE - 0.08, 0.05, color="y").at(rs.Pose.at(0, ASIDE / 2, -0.01))
    spacer = rs.Object(
        "spacer",
        [clamp, bar, clamp.at(rs.Pose.at(0, ASIDE, 0))],
        marks=[
            *([-0.06, y, z] for y in (-0.03, 0.03) for z in (-0.05, 0.03)),  # on the clamp
            *([-0.03, 0.2, z] for z in (-0.03, 0.01)),  # on the bar
        ],
        pose=UPRIGHT @ cable_of(robot).at(SPACER) @ LEVEL,
    )
    wire, none = list(blocks(cable_of(robot))), np.empty((0, 3))
    cables = [
        rs.Object("cable", wire, none),
        rs.Object("second_cable", wire, none, pose=rs.Pose.at(0, ASIDE, 0)),
    ]
    return rs.Scene(robot, [spacer, *cables], eye_on(robot))


def move(joint, to, speed):
    """One joint, at full speed after half a second."""
    return rs.FollowJoints(to={joint: to}, speed=speed, acceleration=2 * speed)


def roll(what, s):
    """Along the cable, until the rear wheel is at arc length s."""
    return rs.Phase(what, move("rear", s, 0.4))


def approach(scene, obstacle, apart, s):
    """Roll until the obstacle is in view, then until the camera sees it at the right distance."""
    front = scene.pose("eye").inv() @ scene.pose(f"{scene.robot().name}.front_lift")
    ahead = rs.Pose((front @ rs.Pose.at(apart, 0, -RADIUS)).matrix)  # of the front wheel
    depth = rs.FeatureBlock(rs.Translation("camera"), components=(2,))  # of its pose in the camera
    by_sight = rs.IBVS(
        goal=rs.GoalPose(ahead),
        target=obstacle,
        features=[depth],
        joints="rear",
        tolerance=1e-3,
        smooth_start=2.0,
        limit=rs.SpeedLimit(joint=0.4),
    )
    return [roll("roll", s), rs.Phase("approach by sight", by_sight)]


def opened(arm, while_open):
    """The wheel goes up off the cable, then aside; after that phase it comes back."""
    return [
        rs.Phase(f"lift the {arm} wheel", move(f"{arm}_lift", 0.08, 0.1)),
        rs.Phase(f"swing the {arm} arm aside", move(f"{arm}_swing", np.radians(85), 0.8)),
        while_open,
        rs.Phase(f"swing the {arm} arm back", move(f"{arm}_swing", 0.0, 0.8)),
        rs.Phase(f"set the {arm} wheel down", move(f"{arm}_lift", 0.0, 0.1)),
    ]


def passing(s):
    """One arm after the other, from the rear wheel's arc length s before the obstacle."""
    return [
        *opened("front", roll("the front arm passes", s + 2 * APART)),
        roll("roll to the rear arm", s + ARMS),
        *opened("rear", roll("the rear arm passes", s + ARMS + 2 * APART)),
        roll("roll on", s + ARMS + 2 * APART + 1.0),
    ]


def cross(scene, approach, passing):
    """Two missions: the second is planned from where the first has come to rest."""
    seen = rs.Mission(scene, approach).run()
    q = seen.legs[-1].q_end
    return seen, rs.Mission(scene, passing(q[0])).run(q)


def missions(scene):
    """The way to the spacer, and past it."""
    return cross(scene, approach(scene, "spacer", APART, 5.5), passing)


def strip(scene, missions, shown, extent):
    """Moments at the ends of some phases; in the first, what the camera looks at."""
    ends = {leg.name: leg.q_end for mission in missions for leg in mission.legs}
    figure = rs.plot.moments(
        scene,
        [ends[phase] for phase in shown],
        list(shown.values()),
        around=f"{scene.robot().name}.centre",
        extent=extent,
        views=["right", "behind"],
    )
    first, thing = next(iter(shown)), scene.objects[0]
    for mark in scene.pose(thing.name) @ thing.marks[:4]:
        x, _, z = np.transpose([scene.pose("eye", ends[first]).position, mark])
        figure.axes[0].plot(x, z, ":", color=palette.PURPLE, linewidth=1, zorder=9)
    return figure


SHOWN = {
    "approach by sight": "it sees the spacer",
    "swing the front arm aside": "the front arm swings aside",
    "the front arm passes": "and passes",
    "roll to the rear arm": "both arms hold",
    "the rear arm passes": "the rear arm passes",
    "set the rear wheel down": "the spacer is behind",
}

if __name__ == "__main__":
    stage = scene()
    done = missions(stage)
    print(*done, sep="\n")
    strip(stage, done, SHOWN, extent=(1.3, 0.9)).savefig("inspection_a.png", dpi=150)
