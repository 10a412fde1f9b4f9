"""Random robots with inertias, the same for generators of oracles and for tests."""

from dataclasses import replace

import numpy as np

import robsim as rs
from robsim.joints import Joint, Link, Mimic


def make_tree(seed, joints=6, floating=False, mimics=False):
    """Return a random robot: revolute and prismatic joints, and fixed links, with inertias."""
    rng = np.random.default_rng(seed)
    links, moving = [Link("base", inertia=draw_inertia(rng))], []
    if floating:
        links.append(draw_link(rng, "body", "base", "floating"))
    for i in range(joints):
        parent = links[rng.integers(len(links) // 2, len(links))].name
        kind = "revolute" if rng.uniform() < 0.7 else "prismatic"
        follows = None
        if mimics and moving and rng.uniform() < 0.4:
            source = moving[rng.integers(len(moving))]
            follows = Mimic(source, *rng.uniform(-2.0, 2.0, 2))
        else:
            moving.append(f"link{i}")
        links.append(draw_link(rng, f"link{i}", parent, kind, follows=follows))
        if rng.uniform() < 0.3:
            links.append(draw_link(rng, f"plate{i}", f"link{i}", "fixed"))
    return rs.Robot("tree", links)


def draw_link(rng, name, parent, kind, **more):
    """Return a link with random poses and a random inertia."""
    place, tail = (
        rs.Pose.at(*rng.uniform(-0.5, 0.5, 3), rpy=rng.uniform(-3.0, 3.0, 3)) for _ in range(2)
    )
    return Link(name, parent, Joint(kind, place, tail, **more), inertia=draw_inertia(rng))


def draw_inertia(rng):
    """Return the inertia of five random points."""
    points, masses = rng.uniform(-0.3, 0.3, (5, 3)), rng.uniform(0.1, 1.0, 5)
    mass = masses.sum()
    centre = masses @ points / mass
    r = points - centre
    tensor = sum(m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, r, strict=True))
    return rs.shapes.Inertia(mass, centre, tensor)


def draw_motion(robot, seed, runs):
    """Return random coordinates (runs, nq), and three arrays (runs, nv)."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-3.0, 3.0, (runs, robot.nq))
    for i, name in enumerate(robot.coordinate_names):
        if name.endswith(".qx"):
            q[:, i : i + 4] = rng.normal(size=(runs, 4))
            q[:, i : i + 4] /= np.linalg.norm(q[:, i : i + 4], axis=1, keepdims=True)
    return q, *rng.uniform(-2.0, 2.0, (3, runs, robot.nv))


def separate(robot):
    """Return the robot with independent joints instead of mimics, and the matrices of both.

    With G (n, nv) and h (n,), the coordinates of the result are G q + h.
    """
    names = list(robot.coordinate_names)
    rows, offsets, links = {}, {}, []
    for link in robot.links:
        joint, follows = link.joint, link.joint.follows
        if joint.moves and follows is None:
            rows[link.label] = np.eye(len(names))[names.index(link.label)]
            offsets[link.label] = 0.0
        links.append(replace(link, joint=replace(joint, follows=None)))
    for link in robot.links:
        follows = link.joint.follows
        if follows is not None:
            rows[link.label] = follows.ratio * rows[follows.of]
            offsets[link.label] = follows.ratio * offsets[follows.of] + follows.offset
    labels = [link.label for link in robot.links if link.joint.moves]
    G, h = (np.array([each[label] for label in labels]) for each in (rows, offsets))
    return replace(robot, links=tuple(links), home=None), G, h
