"""An inspection robot with three arms and a body that shifts passes a clamp (fig. 12)."""

import numpy as np
from inspection_a import (
    LEVEL,
    UPRIGHT,
    approach,
    blocks,
    cable_of,
    cross,
    eye_on,
    move,
    opened,
    roll,
    strip,
)

import robsim as rs

CLAMP = 9.0  # metres along the cable; it hangs the cable from a string of insulators
ARMS = 0.6  # metres from wheel to wheel
APART = 0.26  # metres from the middle of the clamp to a wheel that opens or closes


def scene():
    """The robot, the cable, and the clamp with its string; the kink in the cable is left out."""
    robot = rs.robots.load("inspection_b")
    on_cable = UPRIGHT @ cable_of(robot).at(CLAMP) @ LEVEL
    none = np.empty((0, 3))
    clamp = rs.Object(
        "clamp",
        [
            rs.Block(0.28, 0.05, 0.06, color="y").at(rs.Pose.at(0, 0, -0.01)),
            rs.Block(0.05, 0.02, 0.14, color="y").at(rs.Pose.at(0, 0, 0.08)),
        ],
        marks=[
            *([-0.14, y, z] for y in (-0.02, 0.02) for z in (-0.035, 0.015)),  # on its end
            *([-0.025, 0, z] for z in (0.06, 0.12)),  # on the plate above
        ],
        pose=on_cable,
    )
    heights = 0.2 + 0.07 * np.arange(6)
    discs = [rs.Wheel(0.07, 0.03, color="c").at(rs.Pose.at(0, 0, z)) for z in heights]
    rod = rs.Block(0.02, 0.02, 0.5, color="c").at(rs.Pose.at(0, 0, 0.39))
    string = rs.Object("string", [*discs, rod], none, rs.Pose.at(*on_cable.position))
    cable = rs.Object("cable", list(blocks(cable_of(robot))), none)
    return rs.Scene(robot, [clamp, string, cable], eye_on(robot))


def shift(what, x):
    """The body along the beam, x metres from the rear wheel."""
    return rs.Phase(what, move("body", x, 0.2))


def passing(s):
    """One arm after the other; the body hangs between two that hold."""
    s_middle, s_rear = s + ARMS, s + 2 * ARMS  # where these stand before the clamp
    return [
        shift("the body goes back", 0.5 * ARMS),
        *opened("front", roll("the front arm passes", s + 2 * APART)),
        shift("the body goes to the middle", ARMS),
        roll("roll to the middle arm", s_middle),
        *opened("middle", roll("the middle arm passes", s_middle + 2 * APART)),
        shift("the body goes ahead", 1.5 * ARMS),
        roll("roll to the rear arm", s_rear),
        *opened("rear", roll("the rear arm passes", s_rear + 2 * APART)),
        shift("the body goes to its place", ARMS),
        roll("roll on", s_rear + 2 * APART + 1.0),
    ]


def missions(scene):
    """The way to the clamp, and past it."""
    return cross(scene, approach(scene, "clamp", APART, 5.5), passing)


SHOWN = {
    "approach by sight": "it sees the clamp",
    "the front arm passes": "body back, the front arm passes",
    "the middle arm passes": "body amid, the middle arm passes",
    "the rear arm passes": "body ahead, the rear arm passes",
    "the body goes to its place": "the clamp is behind",
}

if __name__ == "__main__":
    stage = scene()
    done = missions(stage)
    print(*done, sep="\n")
    strip(stage, done, SHOWN, extent=(2.0, 1.25)).savefig("inspection_b.png", dpi=150)
