"""Short experiments in which the fields of every declared class act, as the tables of texts."""

import tomllib
from copy import deepcopy

from acting import Case

import robsim as rs
from robsim import robots

RUN = {"dt": "40 ms", "duration": "0.6 s"}
EYE = {"focal": [800, 790], "size": [640, 480]}
MARKS = ["-10, -9, 0 cm", "11, -10, 3 cm", "9, 10, 0 cm", "0, 2, 1 cm", "-10, 9, 2 cm"]
TURNED = "0.1", "-0.1", "0.14", "0.98"  # a quaternion
FLYING = {
    "schema": 1,
    "robots": [
        {"model": "free_camera", "name": "drone"},
        {"name": "belt", "links": [{"name": "bed"}, {"name": "pallet", "joint": "prismatic"}]},
    ],
    "objects": [
        {"name": "dots", "on": "belt.pallet", "marks": [*MARKS, "-12, 1, -2 cm"]},
        {"name": "others", "marks": MARKS, "position": "2, 1, 3 cm"},
    ],
    "cameras": [
        {"name": "eye", "on": "drone.body", **EYE},
        {"name": "second", "on": "drone.body", **EYE, "position": "6, 0, 0 cm"},
    ],
    "motions": [{"robot": "belt", "rates": ["2 cm/s"]}],
    "start": {"q": ["14 cm", "18 cm", "-90 cm", *TURNED, "0 cm"]},
    "run": RUN,
}
GOAL = {"computed": {"position": "1, 2, 75 cm"}}
SERVO = {"camera": "eye", "target": "dots", "goal": GOAL, "gain": 0.7}
ARM = tomllib.loads(rs.examples.path("eye_in_hand").read_text(encoding="utf-8")) | {"run": RUN}
LIMITS = {"speed": "1 rad/s", "acceleration": "4 rad/s^2"}
SHAPED = {
    "secondary": {"kind": "avoid_limits", "margin": 0.3},
    "projection": {"kind": "large", "low": 0.2, "high": 2.0},
    "smooth_start": 3.0,
    "limit": {"joint": "0.5 rad/s"},
}
# other values of a key, where none can be guessed from the one that stands there
OTHERS = {
    "about": [{"position": "0, 0, -80 cm"}],
    "pose": [{"position": "0, 0, -80 cm"}],
    "roll": [["0 deg", "9 deg"]],
    "mass": ["2 kg"],
    "density": ["2 kg/m^3"],
    "color": ["red"],
    "frame": ["second"],
    "one": ["second"],
    "other": ["second"],
    "belief": [{"cameras": [{"name": name, "focal": [700, 700]}]} for name in ("eye", "camera")],
    "broyden_start": [],
    "camera": ["second"],
    "components": [[0]],
    "damping": [0.3],
    "depth": ["50 cm"],
    "feed_forward": ["estimated"],
    "goal": [{"computed": {"position": "1, 3, 85 cm"}}],
    "position": ["1, 2, 3 cm"],
    "rpy": ["5, 2, 3 deg"],
    "joints": [["link1", "link2", "link3"], ["drone.body.vx", "drone.body.vy"]],
    "lag": ["0.1 s"],
    "limit": [{"joint": "0.1 rad/s"}],
    "marks": [[1, 2, 3, 0], [1, 2]],
    "rcond": [0.5],
    "secondary": ["none"],
    "size": [[500, 400]],
    "smooth_start": [5.0],
    "target": ["others"],
    "tolerance": [0.7, 500.0, 1e6],
    "weighting": [["tukey"]],
}


def world(base, **changes):
    return deepcopy(base) | deepcopy(changes)


def task(kind, base=FLYING, **table):
    """The tables of a scene with a task, and the place of the task in it."""
    given = SERVO if base is FLYING and kind != "switch" else {}
    return world(base, task={"kind": kind, **given, **table}), ("task",)


def part(key, value, base=FLYING, kind="ibvs", **table):
    """Likewise with the place of a part of the task."""
    made, path = task(kind, base, **{**table, key: value})
    return made, (*path, key)


def top(key, value, base=None, **changes):
    """Likewise with the place of another table of the experiment."""
    made = task("ibvs")[0] if base is None else base
    return world(made, **{key: value, **changes}), (key,)


def example(name, *path, **changes):
    """The tables of a shipped example, shortened, and a place in it."""
    made = tomllib.loads(rs.examples.path(name).read_text(encoding="utf-8"))
    return world(made, **{"run": RUN, **changes}), path


def driven(*links, home, tip, by, **robot):
    """The tables of a robot with these links, whose joints follow a trajectory, and its place."""
    one = {"name": "arm", "links": [{"name": "base"}, *links], "home": home, "tip": tip, **robot}
    follow = {"kind": "follow_joints", "by": by, "duration": "0.5 s"}
    return {"schema": 1, "robots": [one], "task": follow, "run": RUN}, ("robots", 0)


def library(name, kind, **changes):
    """A robot of the library that drives, with the first coupling of this kind in it."""
    made = tomllib.loads(robots.file(name).read_text(encoding="utf-8"))
    del made["schema"]
    links = made["links"]
    at = next(i for i, link in enumerate(links) if link.get("follows", {}).get("kind") == kind)
    links[at]["follows"] |= changes
    return made, ("robots", 0, "links", at, "follows")


def car(kind, **others):
    """The car of the library, with a coupling of its wheels."""
    robot, path = library("car", kind)
    return *example("car", *path, robots=[robot]), others


def crawler(kind, of, **changes):
    """The crawler of the library on its cable, with a coupling of its arms."""
    robot, path = library("inspection_a", kind, **changes)
    follow = {"kind": "follow_joints", "by": {"rear": "5 cm"}, "duration": "0.5 s"}
    return {"schema": 1, "robots": [robot], "task": follow, "run": RUN}, path, {"of": of}


def solid(table):
    """A solid whose corners a camera sees."""
    objects = [FLYING["objects"][0], {"name": "solid", "shapes": [table]}]
    made = task("ibvs", target="solid")[0]
    return world(made, objects=objects), ("objects", 1, "shapes", 0)


def followed(table):
    robot = {"model": "planar_2r", "name": "arm"}
    follow = {"kind": "follow_joints", "joints": ["upper", "fore"], "trajectory": table}
    tables = {"schema": 1, "robots": [robot], "task": follow, "run": RUN}
    return tables, ("task", "trajectory")


def with_task(name, **changes):
    """A shipped example with other options of its task, and the place of that."""
    made, path = example(name, "task")
    made["task"] |= deepcopy(changes)
    return made, path


def rail(curve):
    link = {"name": "cart", "joint": "rail", "curve": curve}
    made, path = driven(link, home=["5 cm"], tip="cart", by={"cart": "9 cm"})
    return made, (*path, "links", 1, "curve")


def studied(*path, sensing=None, **study):
    tables = task("ibvs")[0] | {"study": {"runs": 3, "seed": 4, **study}}
    tables |= {"sensing": sensing} if sensing else {}
    return tables, ("study", *path)


def sampled(table):
    return studied("vary", "task.gain", vary={"task.gain": table})


def started(table, **study):
    """A study of a free camera with starts that are drawn."""
    tables = tomllib.loads(rs.examples.path("visp_tutorial").read_text(encoding="utf-8"))
    tables["run"] = {"dt": "40 ms", "duration": "80 ms"}
    tables["study"] = {"runs": 3, "seed": 4, "start": table, **study}
    return tables, ("study", "start")


BROYDEN = [[(3.0 if i % 6 == j else 0.1) for j in range(6)] for i in range(12)]
HIDDEN = {"occlusions": [{"marks": [0], "start": "0.1 s", "end": "0.4 s"}]}
NEAR = ["13.2 cm", "17 cm", "-73 cm", *TURNED, "0 cm"]
FIVE = [f"link{i}" for i in range(1, 6)]
PAIR = {"camera": ["eye", "second"]}
SWITCHED = {"first": {"kind": "pbvs", **SERVO}, "second": {"kind": "ibvs", **SERVO}}
CORNERS = {"length": "20 cm", "width": "16 cm", "height": "6 cm"}
ROUND = {"radius": "9 cm", "n": 5}
JOINTS = [["0 deg", "0 deg"], ["10 deg", "20 deg"], ["15 deg", "0 deg"]]
UNIFORM = {"kind": "uniform", "low": 0.5, "high": 2.0}

# {"family kind", or the name of another class: its cases, (tables, path) or with other values}
RECIPES = {
    "feature sphere": [part("features", {"kind": "sphere", "radius": "5 cm", "marks": [0]})],
    "feature stereo_points": [part("features", {"kind": "stereo_points"}, **PAIR)],
    "interaction matrix broyden": [part("interaction", {"kind": "broyden", "start": BROYDEN})],
    "depth filter": [part("depth", {"kind": "filter", "start": "60 cm"})],
    "feed-forward estimated": [part("feed_forward", {"kind": "estimated", "lag": "0.1 s"})],
    "gain adaptive": [
        part("gain", {"kind": "adaptive", "at_zero": 4, "at_infinity": 0.4, "slope": 30})
    ],
    "law camera": [part("law", {"kind": "camera", "length": "1 m"}, ARM, joints=FIVE)],
    "secondary motion avoid_limits": [part("secondary", SHAPED["secondary"], ARM)],
    "secondary motion posture": [
        part("secondary", {"kind": "posture", "q": ["5 deg"] * 7}, ARM),
    ],
    "projection large": [part("projection", SHAPED["projection"], ARM, **SHAPED)],
    "condition error_below": [
        part("when", {"kind": "error_below", "value": 0.25}, kind="switch", **SWITCHED)
    ],
    "condition near_border": [
        part(
            "when",
            {"kind": "near_border", "margin": 100, "size": [640, 480]},
            **SWITCHED,
            kind="switch",
        )
    ],
    "trajectory quintic": [
        followed({"kind": "quintic", "start": JOINTS[0], "end": JOINTS[1], "duration": "0.5 s"})
    ],
    "trajectory trapezoid": [
        followed({"kind": "trapezoid", "start": JOINTS[0], "end": JOINTS[1], **LIMITS})
    ],
    "trajectory blends": [
        followed({"kind": "blends", "points": JOINTS, "corner": "2 deg", **LIMITS})
    ],
    "shape ball": [solid({"kind": "ball", **ROUND})],
    "shape block": [solid({"kind": "block", **CORNERS})],
    "shape camera": [solid({"kind": "camera", **CORNERS})],
    "shape capsule": [solid({"kind": "capsule", "length": "10 cm", **ROUND})],
    "shape wheel": [solid({"kind": "wheel", "width": "6 cm", **ROUND})],
    "shape tapered_cylinder": [
        solid({"kind": "tapered_cylinder", "length": "10 cm", "end_radius": "4 cm", **ROUND})
    ],
    "curve line": [rail({"kind": "line", "length": "15 cm"})],
    "curve arc": [rail({"kind": "arc", "radius": "1 m", "angle": "0.16 rad"})],
    "curve catenary": [
        rail({"kind": "catenary", "start": "0, 0 m", "end": "1, 0 m", "length": "1.2 m"})
    ],
    "curve polyline": [
        rail({"kind": "polyline", "points": ["0, 0 m", "1, 0 m", "1, 1 m"], "radius": "80 cm"})
    ],
    "coupling ackermann": [car("ackermann", of=["body.x"])],
    "coupling rolling": [car("rolling")],
    "coupling chord": [
        crawler("chord", of=["front"], at="30 cm"),
        crawler("chord", of=["front"]),
    ],
    "coupling mimic": [crawler("mimic", of=["front"])],
    "sampler uniform": [sampled(UNIFORM)],
    "sampler sobol": [sampled({**UNIFORM, "kind": "sobol"})],
    "sampler log_uniform": [sampled({**UNIFORM, "kind": "log_uniform"})],
    "sampler grid": [sampled({**UNIFORM, "kind": "grid", "count": 2})],
    "sampler normal": [sampled({"kind": "normal", "mean": 1.0, "std": 0.1})],
    "sampler given": [sampled({"kind": "given", "values": [0.5, 1.0, 2.0]})],
    "sampler choice": [sampled({"kind": "choice", "values": [0.5, 1.0, 2.0]})],
    "sampler plus": [sampled({"kind": "plus", "of": UNIFORM})],
    "sampler times": [sampled({"kind": "times", "of": UNIFORM})],
    "start look_at": [
        started(
            {
                "kind": "look_at",
                "distance": ["50 cm", "1 m"],
                "aside": "20 cm",
                "axis": [0, 0.1, -1],
            }
        )
    ],
    "start shell": [
        started({"kind": "shell", "distance": ["40 cm", "90 cm"], "angle": ["1 deg", "20 deg"]})
    ],
    "start within": [started({"kind": "within", "radius": "80 cm", "angle": "8 deg"})],
    "start anywhere": [
        started({"kind": "anywhere", "low": [*[-0.5] * 6, 0.9], "high": [*[0.5] * 6, 1]}),
    ],
    "start about": [
        started({"kind": "about", "position": ["80 cm", "40 cm", "3 cm"], "rpy": ["3 deg"] * 3})
    ],
    "ending region": [
        (
            *top(
                "endings",
                [
                    {
                        "kind": "region",
                        "frame": "eye",
                        "low": "-1, -1, -1 m",
                        "high": "1, 1, -0.88 m",
                        "leaves": True,
                    }
                ],
            )[:1],
            ("endings", 0),
        )
    ],
    "ending too_close": [
        (
            top(
                "endings",
                [{"kind": "too_close", "one": "eye", "other": "world", "distance": "89 cm"}],
            )[0],
            ("endings", 0),
        )
    ],
    **{
        f"weighting {name}": [
            (part("weighting", [{"kind": name, "noise": 10}])[0], ("task", "weighting", 0))
        ]
        for name in ("huber", "tukey", "cauchy")
    },
    "weighting border": [
        (
            part("weighting", [{"kind": "border", "width": 250}])[0],
            ("task", "weighting", 0),
            {"least": [100]},
        )
    ],
    "weighting fade": [
        (part("weighting", ["fade"])[0] | {"sensing": HIDDEN}, ("task", "weighting", 0))
    ],
    "task ibvs": [task("ibvs"), task("ibvs", ARM, **SHAPED), task("ibvs", ARM, joints=FIVE)],
    "task pbvs": [task("pbvs"), task("pbvs", ARM, **SHAPED), task("pbvs", ARM, joints=FIVE)],
    "task hybrid": [
        task("hybrid"),
        task("hybrid", ARM, **SHAPED),
        task("hybrid", ARM, joints=FIVE),
    ],
    "task partitioned": [task("partitioned"), task("partitioned", ARM, **SHAPED)],
    "task docking": [example("unicycle_docking", "task")],
    "task placing": [example("chapter_6_2", "task"), with_task("chapter_6_2", **SHAPED)],
    "task priorities": [
        task("priorities", ARM, tasks=[{"kind": "ibvs"}, {"kind": "pbvs"}], **SHAPED),
        task(
            "priorities",
            ARM,
            tasks=[
                {"kind": "ibvs", "features": {"kind": "points", "marks": [0]}},
                {"kind": "pbvs"},
            ],
        ),
    ],
    "task parallel": [
        task("parallel", tasks=[{"kind": "ibvs", **SERVO}], base={**FLYING, "motions": []})
    ],
    "task switch": [task("switch", **SWITCHED, when={"kind": "error_below", "value": 0.25})],
    "task follow_joints": [
        task("follow_joints", ARM, by={"link1": "3 deg"}, duration="0.3 s"),
    ],
    "task follow_path": [
        task("follow_path", ARM, to={"position": "31, 0, 50 cm"}, duration="0.5 s"),
    ],
}


def place(noun, name):
    """The case of a kind of a family of which no recipe is given."""
    value = {"kind": name}
    if noun in ("feature", "law", "inverse", "interaction matrix", "secondary motion"):
        key = {"feature": "features", "interaction matrix": "interaction"}.get(noun, noun)
        return [part(key.split()[0], value, ARM if noun == "inverse" else FLYING)]
    raise LookupError(f"no recipe for the {noun} {name!r}: add one to tests/recipes.py")


def cases(noun, name, kind):
    recipes = RECIPES.get(f"{noun} {name}")
    if recipes is None:
        recipes = place(noun, name)
    return [
        Case(tables, path, {**OTHERS, **(others[0] if others else {})})
        for tables, path, *others in recipes
    ]
