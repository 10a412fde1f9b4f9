"""Short experiments that make the fields of every declared class act, as the tables of texts."""

import atexit
import tomllib
from copy import deepcopy
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

import numpy as np
from acting import Case
from PIL import Image

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
DOTS = {"points": ["-10, -9 cm", "11, -10 cm", "9, 10 cm", "-10, 9 cm"], "radius": "1 cm"}
PRINTED = FLYING | {
    "objects": [{"name": "dots", "on": "belt.pallet", "dots": DOTS}],
    "sensing": {"period": "0.2 s"},  # a dot leaves its place from one picture to the next
}
KEPT = {"places": [{"name": "plate", "position": "30, 1, 10 cm"}]}
MOVED = [{"name": "plate", "position": "32, 1, 11 cm"}]
GOAL = {"computed": {"position": "1, 2, 75 cm"}}
SERVO = {"camera": "eye", "target": "dots", "goal": GOAL, "gain": 0.7}
LENSES = Path(mkdtemp())  # calibration files, until the end of the process
atexit.register(rmtree, LENSES, ignore_errors=True)
for _name, _focal in (("a.xml", 800.0), ("b.xml", 700.0)):
    _K = [[_focal, 0, 320], [0, _focal, 240], [0, 0, 1]]
    rs.Camera(_K, (640, 480)).to_file(LENSES / _name)
(LENSES / "cameras.txt").write_text(
    "1 PINHOLE 640 480 800 800 320 240\n2 PINHOLE 640 480 700 700 320 240\n"
)
ARM = tomllib.loads(rs.examples.path("eye_in_hand").read_text(encoding="utf-8")) | {"run": RUN}
POSTED_ARM = ARM | {
    "objects": [*ARM["objects"], {"name": "post", "marks": MARKS, "position": "31, -30, 24 cm"}]
}
BODIES = {
    "first": "panda.flange",
    "first_end": "panda.base",
    "first_radius": "5 cm",
    "second": "post",
    "second_end": "plate",
    "second_radius": "2 cm",
}
LIMITS = {"speed": "1 rad/s", "acceleration": "4 rad/s^2"}
SHAPED = {
    "secondary": {"kind": "avoid_limits", "margin": 0.3},
    "projection": {"kind": "large", "low": 0.2, "high": 2.0},
    "smooth_start": 3.0,
    "limit": {"joint": "0.5 rad/s"},
}
PHOTOS = [
    str(rs.examples.path(name).parent / "thumbnails" / f"{name}.webp")
    for name in ("car", "unicycle_docking")
]
TAG = {"family": "tag36h11", "id": 7, "size": "20 cm"}
TAGGED = FLYING | {
    "objects": [{"name": "dots", "on": "belt.pallet", "tag": TAG}],
    "sensing": {"period": "0.2 s"},  # a tag leaves its place from one picture to the next
}
POSTED = FLYING | {
    "objects": [
        {
            "name": "dots",
            "on": "belt.pallet",
            "marks": ["-10, -9, 0 cm", "11, -10, 0 cm", "9, 10, 0 cm", "-10, 9, 0 cm"],
            "shapes": [{"kind": "poster", "picture": PHOTOS[0], "width": "40 cm"}],
        }
    ],
    "sensing": {"period": "0.2 s"},
}
PICTURED = POSTED | {  # small pictures, most of which the poster fills
    "cameras": [{**EYE, "name": "eye", "on": "drone.body", "focal": [100, 99], "size": [80, 60]}],
    "sensing": {},
    "run": {"dt": "50 ms", "duration": "0.2 s"},
}
GOAL_BESIDE = {"q": ["14.5 cm", "18 cm", "-89 cm", *TURNED, "0 cm"]}  # from the start of FLYING
for _name, _step in (("a.png", 3), ("b.png", 5)):
    _greys = np.arange(60)[:, None] * _step + np.arange(80) ** 2 * 0.02
    Image.fromarray(np.rint(_greys % 256).astype(np.uint8)).save(LENSES / _name)
PHOTOGRAPHED = {**GOAL_BESIDE, "picture": f"{LENSES}/a.png"}
COVERED = TAGGED | {  # by another tag
    "objects": [
        *TAGGED["objects"],
        {"name": "cover", "on": "dots", "position": "0, 0, -1 mm", "tag": {**TAG, "id": 8}},
    ]
}
BOARD = {"family": "DICT_4X4_50", "columns": 4, "rows": 3, "square": "6 cm", "tag": "4 cm"}
STORED = {
    "file": "ost.yaml",
    "size": [640, 480],
    "K": [[800, 0, 320], [0, 790, 240], [0, 0, 1]],
    "distortion": [0.05, 0.0, 0.0, 0.0],
}
OTHER_FILE = {"calibration": [{"file": f"{LENSES}/b.xml"}]}
# other values of a key if none can be guessed from the present one
OTHERS = {
    "about": [{"position": "0, 0, -80 cm"}],
    "pose": [{"position": "0, 0, -80 cm"}],
    "roll": [["0 deg", "9 deg"]],
    "mass": ["2 kg"],
    "density": ["2 kg/m^3"],
    "color": ["red"],
    "frame": ["second", "panda.link6"],
    "one": ["second"],
    "other": ["second"],
    "belief": [{"cameras": [{"name": name, "focal": [700, 700]}]} for name in ("eye", "camera")],
    "broyden_start": [],
    "camera": ["second"],
    "constraints": [[{"kind": "joint_speeds", "most": "0.05 rad/s"}]],
    "law": ["camera"],
    "components": [[0]],
    "damping": [0.3],
    "detector": ["dots"],
    "depth": ["50 cm", {"kind": "filter", "start": "50 cm"}],
    "feed_forward": ["estimated"],
    "goal": [{"computed": {"position": "1, 3, 85 cm"}}],
    "position": ["1, 2, 3 cm"],
    "rpy": ["5, 2, 3 deg"],
    "joints": [["link2", "link1"], ["link1", "link2", "link3"], ["drone.body.vx", "drone.body.vy"]],
    "lag": ["0.1 s"],
    "limit": [{"joint": "0.01 rad/s"}],
    "marks": [[1, 2, 3, 0], [1, 2]],
    "filename": ["b.stl"],
    "first_run": [3],
    "noise": [1.0, 3.0, 1000.0],
    "rcond": [0.5],
    "seed": [5],
    "secondary": [{"kind": "posture", "q": ["5 deg"] * 7}],
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
    flying = base.get("cameras") == FLYING["cameras"] and kind not in ("switch", "parallel")
    given = SERVO if flying else {}
    return world(base, task={"kind": kind, **given, **table}), ("task",)


def part(key, value, base=FLYING, kind="ibvs", index=None, **table):
    """Likewise with the place of a part of the task."""
    made, path = task(kind, base, **{**table, key: value})
    return made, (*path, key, *([] if index is None else [index]))


def limited(kind, base=None, **table):
    """The tables of an arm whose law has a constraint of this kind, and its place."""
    law = {"kind": "constrained", "constraints": [{"kind": kind, **table}]}
    several = {} if base is None else {"target": "plate"}
    made, path = part("law", law, ARM if base is None else base, **several)
    return made, (*path, "constraints", 0)


def of_pictures(kind, extension=None, **others):
    """The cases of a feature of pictures: one that goes on, and one that ends."""
    more = {} if extension is None else {"extension": extension}
    table = {"kind": kind, **more}
    return [
        (*part("features", table, PICTURED, **SERVO), others),
        (
            *part("features", {**table, "tolerance": 1e6, "step": 1e3}, PICTURED, **SERVO),
            {"step": [1e-9], **others},
        ),
    ]


def damped(kind):
    """The case of a dense feature whose damping changes."""
    table = {"kind": kind, "final_damping": 0.5, "switch_time": "0.1 s"}
    return [part("features", table, PICTURED, **SERVO)]


def top(key, value, base=None, **changes):
    """Likewise with the place of another table of the experiment."""
    made = task("ibvs")[0] if base is None else base
    return world(made, **{key: value, **changes}), (key,)


def example(name, *path, **changes):
    """The tables of a shipped example, shortened, and a place in it."""
    made = tomllib.loads(rs.examples.path(name).read_text(encoding="utf-8"))
    return world(made, **{"run": RUN, **changes}), path


def make_driven_robot(*links, home, tip, by, **robot):
    """The tables of a robot with these links and joints that follow a trajectory, and its place."""
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


def steered():
    """The car of the library, which is to turn its wheels farther and faster than it can."""
    made, path, _ = car("rolling")
    made["run"] = {"dt": "40 ms", "duration": "2 s"}
    others = {"limit": ["0.35 rad"], "rate": ["0.1 rad/s"]}
    return made, (*path[:3], 1, "steering"), others


def crawler(kind, of, **changes):
    """The crawler of the library on its cable, with a coupling of its arms."""
    robot, path = library("inspection_a", kind, **changes)
    follow = {"kind": "follow_joints", "by": {"rear": "5 cm"}, "duration": "0.5 s"}
    return {"schema": 1, "robots": [robot], "task": follow, "run": RUN}, path, {"of": of}


def targeted(key, table):
    """A scene with a tag or a board in place of the marks, and the place of the object."""
    one = {"name": "dots", "on": "belt.pallet", key: table}
    made, _ = task("ibvs")
    return world(made, objects=[one, *FLYING["objects"][1:]]), ("objects", 0), {key: [table]}


def aimed(key, table):
    """The same, and the place of the tag or board."""
    made, path, _ = targeted(key, table)
    return made, (*path, key), {"family": ["tag25h9", "DICT_5X5_50"]}


def calibrated(table, **others):
    """A scene with a calibration of its camera, and the place of the calibration."""
    eye = {"name": "eye", "on": "drone.body", "calibration": table}
    made, _ = task("ibvs")
    return world(made, cameras=[eye, FLYING["cameras"][1]]), ("cameras", 0, "calibration"), others


def solid(table):
    """A solid with corners that a camera sees."""
    objects = [FLYING["objects"][0], {"name": "solid", "shapes": [table]}]
    made = task("ibvs", target="solid")[0]
    return world(made, objects=objects), ("objects", 1, "shapes", 0)


def shaped(table):
    """The same solid before a camera, and as a part of a link, also of one that has weight."""
    return [solid(table), linked("shapes", [table], 0), weighed("shapes", [table], 0)]


def pictured(table, **others):
    """The same with other pictures."""
    return [(*each, {"picture": [PHOTOS[1]], **others}) for each in shaped(table)]


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


def anywhere(start, **study):
    """A study of an arm with starts anywhere between its limits, or in a box."""
    tables = task("ibvs", ARM)[0] | {"run": {"dt": "40 ms", "duration": "80 ms"}}
    start = {"kind": "anywhere", **start}
    return tables | {"study": {"runs": 3, "seed": 4, "start": start, **study}}, ("study", "start")


def with_random_starts(tables, path, joint="cart"):
    """The same experiment with starts between the limits of its joints."""
    start = {"kind": "anywhere", "visible": False}
    tables["task"]["by"] = {joint: "0.5 cm" if joint == "cart" else "1 deg"}
    return world(tables, study={"runs": 2, "seed": 4, "start": start}), path


def mimicking(follows):
    links = [
        {"name": "a", "joint": "revolute"},
        {"name": "b", "joint": "revolute"},
        {"name": "c", "joint": "revolute", "place": {"position": "1, 0, 0 m"}, "follows": follows},
        {"name": "d", "place": {"position": "1, 0, 0 m"}},
    ]
    home = ["5 deg", "9 deg"]
    made, path = make_driven_robot(*links, home=home, tip="d", by={"a": "9 deg", "b": "5 deg"})
    return made, (*path, "links", 3, "follows"), {"of": ["b"]}


def ended(kind, **given):
    return top("endings", [{"kind": kind, **given}])[0], ("endings", 0)


def moving(**given):
    """An arm with lag that follows a trajectory of its joints."""
    made = world(ARM, task={"kind": "follow_joints", **given}, actuation={"lag": "50 ms"})
    return made, ("task",)


def reaching(**given):
    """An arm with lag that follows a path of its flange."""
    given = {"kind": "follow_path", "frame": "panda.flange", **given}
    return world(ARM, task=given, actuation={"lag": "50 ms"}), ("task",)


def carried():
    """Two fixed cameras watch the object that a redundant arm holds."""
    scene = rs.Scene(rs.robots.panda())
    T = scene.pose("panda.flange")
    cube = {
        "name": "cube",
        "on": "panda.flange",
        "marks": ["0, 0, 6 cm", "0, 5, 6 cm", "5, 0, 7 cm"],
    }
    made = {"schema": 1, "robots": [{"model": "panda"}], "objects": [cube], "run": RUN}
    made["cameras"] = [looking(name, T.position, x) for name, x in (("left", -0.1), ("right", 0.1))]
    given = {"kind": "placing", "camera": ["left", "right"], **SHAPED}
    home = np.degrees(scene.home)
    made["start"] = {"q": [f"{x + 4:.6f} deg" for x in home]}
    return world(made, task=given), ("task",)


def looking(name, at, x):
    """A camera that looks up at a place from below."""
    eye = np.add(at, [x, 0.05, -0.4])
    z = (at - eye) / np.linalg.norm(at - eye)
    side = np.cross([0.0, 1.0, 0.0], z)
    side /= np.linalg.norm(side)
    R = np.column_stack([side, np.cross(z, side), z])
    where = ", ".join(f"{each:.9f}" for each in eye)
    return {"name": name, "position": f"{where} m", "rotation": R.tolist(), **EYE}


def mission():
    tasks = ({**IBVS, "gain": 3.0}, {"kind": "follow_joints", "by": {"link1": "2 deg"}})
    tasks[1]["duration"] = "0.2 s"
    look, turn = (
        {"name": name, "task": each} for name, each in zip(("a", "b"), tasks, strict=True)
    )
    look |= {"duration": "0.2 s", "expects": ["time_limit"]}
    return world(ARM, task={"kind": "mission", "phases": [look, turn]})


def hanging():
    """A mission: a plate moves with the arm, and then stays at its place."""
    made = mission()
    look, turn = made["task"]["phases"]
    turn["attach"], look["release"] = {"plate": "panda.link1"}, ["plate"]
    made["task"]["phases"] = [turn, look]
    return made


def linked(key, value, *more, others=None):
    """An arm of two links; the second has this besides."""
    links = [
        {"name": "a", "joint": "revolute", "limits": ["-90 deg", "90 deg"]},
        {"name": "b", "joint": "revolute", "limits": ["-90 deg", "90 deg"], key: value},
    ]
    made, path = make_driven_robot(
        *links, home=["5 deg", "9 deg"], tip="b", by={"a": "9 deg", "b": "5 deg"}
    )
    return made, (*path, "links", 2, key, *more), others or {}


def weighed(key, value, *more, others=None):
    """An arm of two links with weight and drives; the second has this besides."""
    inertia = {"mass": "1 kg", "moments": "0.1, 0.1, 0.1 kg m^2", "centre": "10, 0, 0 cm"}
    link = {"joint": "revolute", "limits": ["-90 deg", "90 deg"], "inertia": inertia}
    across = {"position": "20, 0, 0 cm", "rpy": "90, 0, 0 deg"}
    links = [{"name": "a", **link}, {"name": "b", **link, "place": across, key: value}]
    if key == "shapes":
        del links[1]["inertia"]
        links[1]["shapes"] = [*value, {"kind": "ball", "radius": "8 cm", "mass": "1 kg"}]
    made, path = make_driven_robot(
        *links, home=["5 deg", "9 deg"], tip="b", by={"a": "9 deg", "b": "5 deg"}
    )
    tables = world(made, actuation={"drive": "velocity_loop"})
    return tables, (*path, "links", 2, key, *more), others or {}


def imperfect(key, effect, base=None):
    """An experiment with an effect on images, or on joints, and its place."""
    made = task("ibvs")[0] if base is None else base
    return world(made, **{key: {"effects": [effect]}}), (key, "effects", 0)


def powered(drive, **more):
    """An arm with a drive and its place; it starts with a load that is known to no drive."""
    return world(ARM_SERVO, actuation={"drive": drive, **more}), ("actuation", "drive")


def pushed(*path):
    """An arm whose law commands torques, with a place in its tables."""
    law = {"kind": "torque", "stiffness": 40.0, "saturation": 0.05}
    drive = {"kind": "torque_input", "damping": [20.0] * 7}
    return world(part("law", law, ARM)[0], actuation={"drive": drive}), path


def rail(curve):
    link = {"name": "cart", "joint": "rail", "curve": curve}
    made, path = make_driven_robot(link, home=["5 cm"], tip="cart", by={"cart": "9 cm"})
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


ARM_SERVO = task("ibvs", ARM)[0]
MISMATCHED = {**FLYING, "sensing": {"outliers": 0.3}}
BROYDEN = [[(3.0 if i % 6 == j else 0.1) for j in range(6)] for i in range(12)]
HIDDEN = {"occlusions": [{"marks": [0], "start": "0.1 s", "end": "0.4 s"}]}
NEAR = ["13.2 cm", "17 cm", "-73 cm", *TURNED, "0 cm"]
FIVE = [f"link{i}" for i in range(1, 6)]
PAIR = {"camera": ["eye", "second"]}
SWITCHED = {"first": {"kind": "pbvs", **SERVO}, "second": {"kind": "ibvs", **SERVO}}
CORNERS = {"length": "20 cm", "width": "16 cm", "height": "6 cm"}
ROUND = {"radius": "9 cm", "n": 5}
BLOCK_FACES = ("front", "back", "left", "right", "top", "bottom")
JOINTS = [["0 deg", "0 deg"], ["10 deg", "20 deg"], ["15 deg", "0 deg"]]
UNIFORM = {"kind": "uniform", "low": 0.5, "high": 2.0}

# {"family kind", or the name of another class: its cases, (tables, path) or with other values}
IBVS = {"kind": "ibvs"}
HOME = rs.robots.panda().home
ONE_MARK = {"kind": "points", "marks": [0]}
LOW = {"low": ["-1, -1, -0.895 m"]}
BELOW = {"kind": "error_below", "value": 0.25}
QUINTIC = {"kind": "quintic", "start": ["-13 deg", "-33 deg"], "end": ["-10 deg", "-30 deg"]}
QUINTIC["duration"] = "0.5 s"
PACE = {
    "speed": "20 cm/s",
    "acceleration": "1 m/s^2",
    "turn": "40 deg/s",
    "turn_acceleration": "2 rad/s^2",
}
FLANGE = {"position": "31, 0, 55 cm"}
OF_PAIR = {
    "belief": [{"cameras": [{"name": "left", "focal": [700, 700]}]}],
    "marks": [[0, 2, 1]],
    "joints": [[f"link{i}" for i in range(1, 7)]],
}
BESIDE = world(
    {key: value for key, value in FLYING.items() if key != "motions"},
    task={
        "kind": "parallel",
        "tasks": [
            {**IBVS, **SERVO, "joints": "drone"},
            {"kind": "follow_joints", "by": {"belt.pallet": "5 cm"}, "duration": "0.5 s"},
        ],
    },
)
OF_BLOCK = {"keys": {"feature": ["kind"]}, "kind": ["pixels"]}
BLOCK = {"kind": "points", "marks": [0, 1, 2, 3], "weight": 2.0}
PLACED = started({"kind": "anywhere"})[0]
del PLACED["study"]
STRAIGHT = {"start": FLANGE, "end": {"position": "31, 0, 50 cm", "rpy": "180, 0, 5 deg"}}
SLOW = {"joint": "0.05 rad/s", "linear": "1 cm/s", "angular": "1 deg/s"}
OF_PHASE = {
    "name": ["other"],
    "task": [{"kind": "follow_joints", "by": {"link1": "4 deg"}, "duration": "0.2 s"}],
    "duration": ["0.08 s"],
}
WHOLE = task("ibvs")[0]
BALL = {"kind": "ball", "radius": "9 cm", "n": 5}
OF_WHOLE = {
    "robots": [[{**WHOLE["robots"][0], "on": "belt.pallet"}, WHOLE["robots"][1]]],
    "title": ["another"],
    "sensing": [{"noise": 1.0}],
    "actuation": [{"lag": "50 ms"}],
    "safety": [{"ramp": "0.2 s"}],
    "ros2": [{"patience": "0.2 s"}],
    "endings": [[{"kind": "too_close", "one": "eye", "other": "eye", "distance": "1 m"}]],
    "display": [{"rpy": "0, 0, 9 deg"}],
}
STUDIED = studied(vary={"task.gain": UNIFORM})[0]
ROW = {"theta": "5 deg", "d": "10 cm", "a": "20 cm", "alpha": "30 deg"}
TOOL = {
    "name": "grip",
    "links": [{"name": "a"}, {"name": "b", "joint": "revolute", "dh": ROW}, {"name": "c"}],
    "position": "0, 0, 9 cm",
    "home": ["5 deg"],
}
OF_ROBOT = {"name": ["other"], "tools": [[TOOL]], "on": ["nowhere"], "tip": ["a"]}
OF_ROBOT |= {"about": ["other"], "sources": [["other"]]}
TOOLED = linked("shapes", [BALL])[0]
del TOOLED["robots"][0]["tip"]
TOOLED["robots"][0]["tools"] = [TOOL]
OF_TOOL = {
    **OF_ROBOT,
    "on": ["a"],
    "tip": ["a"],
    "convention": ["modified"],
    "home": [["15 deg"]],
    "model": ["rhino_gripper"],
}
OF_LINK = {
    "name": ["other"],
    "parent": ["base"],
    "joint": ["prismatic"],
    "joint_name": ["other"],
    "speed": ["1 rad/s"],
    "effort": [0.9],
    "armature": [0.02],
    "damping": [0.3],
    "friction": [0.4],
    "place": [{"position": "1, 0, 0 m"}],
    "tail": [{"position": "1, 0, 0 m"}],
    "shapes": [[BALL]],
    "inertia": [{"mass": "1 kg", "moments": "1, 1, 1 kg m^2"}],
    "limits": [["-1 deg", "1 deg"]],
}
OF_CAMERA = {
    "name": ["other"],
    "on": ["world"],
    "size": [[300, 200]],
    "center": [[310, 250]],
    "skew": [5.0],
    "distortion": [[0.1, 0.0, 0.0, 0.0]],
    "lens": ["fisheye"],
    "body": [{"length": "1 cm", "width": "1 cm", "height": "1 cm"}],
    "optics": [{"gain": 0.5}],
}
BAD_OPTICS = {"full_well": 9000, "read_noise": 2.0, "defocus": 1.5, "vignetting": 4.0}
BAD_OPTICS |= {"exposure": "5 ms", "readout": "20 ms", "gain": 1.2, "gamma": 2.2, "bits": 7}
DEVELOPED = deepcopy(WHOLE)
DEVELOPED["cameras"][0] |= {"size": [160, 120], "focal": [200, 200], "optics": BAD_OPTICS}
LIT = {"kind": "ball", "radius": "2 cm", "position": "0.01, 0.02, 0.1 m", "n": 8}
DEVELOPED["objects"] = [
    *DEVELOPED["objects"],
    {"name": "lit", "marks": [], "on": DEVELOPED["cameras"][0]["on"], "shapes": [LIT]},
]
BY_MATRIX = deepcopy(WHOLE)
del BY_MATRIX["cameras"][0]["focal"]
BY_MATRIX["cameras"][0]["K"] = [[800, 0, 320], [0, 790, 240], [0, 0, 1]]
OTHER_K = {"K": [[[700, 0, 320], [0, 790, 240], [0, 0, 1]]]}
TURN = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
OF_SENSING = {
    "noise": [1.0],
    "quantisation": [1.0],
    "occlusions": [HIDDEN["occlusions"]],
    "dropped": [0.5],
    "latency": ["40 ms"],
    "period": ["80 ms"],
    "effects": [[{"kind": "noise", "noise": 2.0}]],
}
LOAD = {"on": "panda.flange", "mass": "1.5 kg", "centre": "0, 5, 10 cm"}
OF_DRIVE = {
    "torque_limit": [5.0],
    "integral_rate": [30.0],
    "period": ["4 ms"],
    "model": [{"mass": 0.8}],
}
OF_ACTUATION = {
    "drive": ["velocity_loop"],
    "lag": ["50 ms"],
    "velocity": ["0.05 rad/s"],
    "acceleration": ["0.5 rad/s^2"],
    "encoder": ["1 deg"],
    "effects": [[{"kind": "lag", "lag": "50 ms"}]],
}
OF_CONNECTION = {
    **{key: ["/other"] for key in ("joints", "marks", "images", "commands", "odometry", "run")},
    "command_type": ["sensor_msgs/msg/JointState"],
    "marks_type": ["std_msgs/msg/Float64MultiArray"],
    "names": [{"link1": "joint_1"}],
    "ids": [{"plate": ["a", "b", "c", "d"]}],
    "order": [["link7", "link6", "link5", "link4", "link3", "link2", "link1"]],
    "frames": [{"world": "map"}],
    "patience": ["0.2 s"],
    "timeout": ["0.2 s"],
}
FENCE = {"frame": "panda.flange", "low": "-2, -2, 0 m", "high": "2, 2, 2 m"}
OF_SAFETY = {
    "speed": ["0.05 rad/s"],
    "acceleration": ["0.1 rad/s^2"],
    "margin": [f"{x} deg" for x in (12, 20, 28, 35, 60, 75, 85)],
    "fence": [{**FENCE, "high": "2, 2, 0.01 m"}],
    "watchdog": [{"after": "50 ms"}],
}
NEAR = {**FENCE, "low": "0.25, -2, 0 m"}
HIGH = {
    "high": ["2, 2, 0.01 m"],
    "low": [f"{x}, -2, {z} m" for x in (-2, 0.32) for z in (0, 0.45, 0.6)],
    "frame": ["panda.base"],
}
OF_STUDY = {
    "start": [{"kind": "within", "radius": "1 cm"}],
    "starts": [[[0.15, 0.18, -0.9, 0.1, -0.1, 0.14, 0.98, 0.0]] * 3],
    "vary": [{"task.gain": {**UNIFORM, "high": 3.0}}],
    "trajectories": [2],
}
HALF_TURN = FLYING | {  # a start from which every number of a prediction changes the choice
    "robots": [{"model": "free_camera"}],
    "objects": [
        {"name": "square", "marks": [f"{x}, {y}, 0 cm" for x, y in ((-10, -10), (10, -10))]}
    ],
    "cameras": [{"name": "eye", "on": "free_camera.body", "focal": [502, 502], "size": [640, 480]}],
    "motions": [],
    "start": {"position": "95, -107, 546 mm", "rotvec": "0, 175.4, 9.6 deg"},
}
HALF_TURN["objects"][0]["marks"] += ["10, 10, 0 cm", "-10, 10, 0 cm"]
ROLLOUT = {
    "kind": "rollout",
    "laws": ["joint"],
    "schemes": [{"kind": "pbvs"}, {"kind": "ibvs", "interaction": "mean"}],
    "horizon": "4 s",
    "period": "0.1 s",
    "margin": 4.0,
    "hysteresis": 0.1,
}
OF_ROLLOUT = {
    "laws": [[{"kind": "camera", "length": "10 cm"}]],
    "schemes": [[{"kind": "hybrid"}]],
    "horizon": ["1 s"],
    "period": ["0.2 s"],
    "margin": [30.0],
    "hysteresis": [0.9],
}
ABOVE = {"position": "0, 0, 61 cm", "rotvec": "180, 0, 0 deg"}  # faces the square
RECIPES = {
    "feature sphere": [part("features", {"kind": "sphere", "radius": "5 cm", "marks": [0]})],
    "feature stereo_points": [part("features", {"kind": "stereo_points"}, **PAIR)],
    "interaction matrix broyden": [part("interaction", {"kind": "broyden", "start": BROYDEN})],
    "depth filter": [part("depth", {"kind": "filter", "start": "60 cm"})],
    "feed-forward estimated": [part("feed_forward", {"kind": "estimated", "lag": "0.1 s"})],
    "gain adaptive": [
        part("gain", {"kind": "adaptive", "at_zero": 4, "at_infinity": 0.4, "slope": 30})
    ],
    "law constrained": [
        part(
            "law",
            {"kind": "constrained", "constraints": [{"kind": "joint_speeds", "most": "0.1 rad/s"}]},
            ARM,
            joints=FIVE,
        )
    ],
    "constraint field_of_view": [
        limited("field_of_view", margin=200, rate=8, noise=5),
        limited("field_of_view", margin=150, depth_error=0.3, focal_error=0.2),
    ],
    "constraint mark_depth": [limited("mark_depth", least="60 cm", depth_error=0.2)],
    "constraint joint_limits": [limited("joint_limits", margin="50 deg")],
    "constraint joint_speeds": [limited("joint_speeds", most="0.1 rad/s")],
    "constraint joint_accelerations": [limited("joint_accelerations", most="0.2 rad/s^2")],
    "constraint half_space": [
        limited("half_space", frame="panda.flange", normal=[0, 0.1, -1], offset="-42 cm", rate=3)
    ],
    "constraint workspace_box": [
        limited(  # the start is outside
            "workspace_box", frame="panda.flange", low="30, -100, 0 cm", high="1, 1, 0.42 m", rate=3
        )
    ],
    "constraint clearance": [
        (
            *limited("clearance", POSTED_ARM, **BODIES, distance="40 cm", rate=3),
            {"first": ["panda.link5"], "second": ["plate"], "first_end": ["panda.link2"]},
        )
    ],
    "constraint line_of_sight": [
        (
            *limited("line_of_sight", POSTED_ARM, body="post", end="plate", radius="9 cm", rate=3),
            {"body": ["panda.link5"], "end": ["panda.link4"]},
        )
    ],
    "law torque": [pushed("task", "law")],
    "drive torque_input": [(*pushed("actuation", "drive"), OF_DRIVE)],
    "law camera": [part("law", {"kind": "camera", "length": "1 m"}, ARM, joints=FIVE)],
    "law rollout": [(*part("law", ROLLOUT, HALF_TURN, goal=ABOVE), OF_ROLLOUT)],
    "secondary motion avoid_limits": [part("secondary", SHAPED["secondary"], ARM)],
    "secondary motion posture": [part("secondary", {"kind": "posture", "q": ["5 deg"] * 7}, ARM)],
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
    "shape ball": shaped({"kind": "ball", **ROUND}),
    "shape block": pictured({"kind": "block", **CORNERS}, pictures=[{"top": PHOTOS[1]}]),
    "shape poster": pictured({"kind": "poster", "width": "10 cm", "picture": PHOTOS[0]}),
    "shape camera": shaped({"kind": "camera", **CORNERS}),
    "shape capsule": shaped({"kind": "capsule", "length": "10 cm", **ROUND}),
    "shape wheel": shaped({"kind": "wheel", "width": "6 cm", **ROUND}),
    "shape tapered_cylinder": shaped(
        {"kind": "tapered_cylinder", "length": "10 cm", "end_radius": "4 cm", **ROUND}
    ),
    "curve line": [
        rail({"kind": "line", "length": "15 cm"}),
        with_random_starts(*rail({"kind": "line", "length": "15 cm"})),
    ],
    "curve arc": [
        rail({"kind": "arc", "radius": "1 m", "angle": "0.16 rad"}),
        with_random_starts(*rail({"kind": "arc", "radius": "1 m", "angle": "0.16 rad"})),
    ],
    "curve catenary": [
        rail({"kind": "catenary", "start": "0, 0 m", "end": "1, 0 m", "length": "1.2 m"})
    ],
    "curve polyline": [
        rail({"kind": "polyline", "points": ["0, 0 m", "1, 0 m", "1, 1 m"], "radius": "80 cm"})
    ],
    "coupling ackermann": [car("ackermann", of=["body.x"])],
    "coupling rolling": [car("rolling")],
    "coupling chord": [crawler("chord", of=["front"], at="30 cm"), crawler("chord", of=["front"])],
    "coupling mimic": [mimicking({"kind": "mimic", "of": "a", "ratio": 2.0, "offset": "5 deg"})],
    "sampler uniform": [sampled(UNIFORM)],
    "sampler sobol": [sampled({**UNIFORM, "kind": "sobol"})],
    "sampler log_uniform": [sampled({**UNIFORM, "kind": "log_uniform"})],
    "sampler grid": [sampled({**UNIFORM, "kind": "grid", "count": 3})],
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
                "aside": "60 cm",
                "axis": [0, 0.1, -1],
            }
        )
    ],
    "start shell": [
        started({"kind": "shell", "distance": ["40 cm", "90 cm"], "angle": ["1 deg", "20 deg"]})
    ],
    "start within": [started({"kind": "within", "radius": "80 cm", "angle": "8 deg"})],
    "start anywhere": [anywhere({"low": list(HOME - 0.07), "high": list(HOME + 0.8)})],
    "start about": [
        started({"kind": "about", "position": ["80 cm", "40 cm", "3 cm"], "rpy": ["3 deg"] * 3})
    ],
    "ending region": [
        (*ended("region", frame="eye", low="-1, -1, -1 m", high="1, 1, -0.88 m", leaves=True), LOW)
    ],
    "ending too_close": [
        (*ended("too_close", one="eye", other="world", distance="89 cm"), {"one": ["dots"]})
    ],
    **{
        f"weighting {name}": [
            (
                part("weighting", [{"kind": name, "noise": 10.0}], MISMATCHED)[0],
                ("task", "weighting", 0),
            )
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
    "mark detector dots": [
        (
            *part("detector", {"kind": "dots"}, PRINTED, gain=4.0),
            {"reach": [1.0], "least_area": [1e6], "least_contrast": [255]},
        )
    ],
    "mark detector keypoints": [
        (
            *part("detector", {"kind": "keypoints"}, POSTED, gain=4.0),
            {
                "ratio": [0.3],
                "keypoints": [60],
                "tolerance": [0.2],
                "least_matches": [10_000],
                "neighbourhood": [1e-4],
                "least_nearby": [10_000],
            },
        )
    ],
    "mark detector tags": [
        (*part("detector", {"kind": "tags"}, TAGGED), {"targets": [[{**TAG, "id": 8}]]})
    ],
    "mark detector tag_tracker": [
        (
            *part("detector", {"kind": "tag_tracker"}, TAGGED, gain=4.0),
            {"reach": [1.0], "search_every": [1]},
        ),
        (*part("detector", {"kind": "tag_tracker"}, COVERED, gain=4.0), {"most_wrong": [100]}),
    ],
    "feature vanishing_point": [
        part("features", {"kind": "vanishing_point", "marks": [0, 1, 2, 3]})
    ],
    "feature cosine_coefficients": of_pictures("cosine_coefficients"),
    "feature defocus": of_pictures("defocus") + damped("defocus"),
    "feature histogram": of_pictures("histogram") + damped("histogram"),
    "feature luminance": of_pictures("luminance") + damped("luminance"),
    "feature mutual_information": of_pictures("mutual_information") + damped("mutual_information"),
    "feature photometric_mixture": [
        *of_pictures("photometric_mixture", extension=3.0),
        *damped("photometric_mixture"),
        part(
            "features",
            {"kind": "photometric_mixture", "extension": 9.0},
            PICTURED,
            **{**SERVO, "goal": GOAL_BESIDE},
        ),
    ],
    "feature photometric_moments": of_pictures("photometric_moments"),
    "feature principal_components": of_pictures("principal_components", count=[8], pictures=[40]),
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
    "task docking": [
        (*example("unicycle_docking", "task"), {"joints": [["body.v"]], "tolerance": [9.0]})
    ],
    "task placing": [(*carried(), OF_PAIR)],
    "task priorities": [
        task("priorities", ARM, tasks=[{"kind": "ibvs"}, {"kind": "pbvs"}], **SHAPED),
        task("priorities", ARM, tasks=[{**IBVS, "features": ONE_MARK}, {"kind": "pbvs"}], **SHAPED),
        task("priorities", ARM, tasks=[{**IBVS, "features": ONE_MARK}, {"kind": "pbvs"}]),
    ],
    "task parallel": [(BESIDE, ("task",))],
    "task switch": [task("switch", {**FLYING, "sensing": {"noise": 20}}, **SWITCHED, when=BELOW)],
    "task follow_joints": [
        moving(by=["3 deg"] * 7, duration="0.3 s"),
        moving(to={"link1": "-12 deg"}, speed="0.04 rad/s", acceleration="4 rad/s^2", gain=2.0),
        moving(trajectory=QUINTIC, joints=["link1", "link2"]),
    ],
    "task follow_path": [
        reaching(to={"position": "31, 0, 50 cm"}, duration="0.5 s", **SHAPED, gain=2.0),
        reaching(to={"position": "31, 0, 50 cm"}, duration="0.2 s"),
        reaching(to={"position": "31, 0, 50 cm"}, **PACE),
        reaching(path={"start": FLANGE, "end": {"position": "31, 0, 50 cm"}, "duration": "0.5 s"}),
        reaching(to={"position": "31, 0, 50 cm"}, duration="0.5 s", mask="position", **SHAPED),
    ],
    "task mission": [(mission(), ("task",))],
    "BlockPictures": [
        linked(
            "shapes",
            [{"kind": "block", **CORNERS, "pictures": {"top": PHOTOS[1]}}],
            *(0, "pictures"),
            others={key: [PHOTOS[0]] for key in BLOCK_FACES},
        )
    ],
    "shape mesh": [
        linked(
            "shapes",
            [{"kind": "mesh", "filename": "a.stl"}],
            0,
            others={"content": [{"sha256": 64 * "a"}]},  # its data is missing
        )
    ],
    **{
        f"image effect {name}": [imperfect("sensing", {"kind": name, **given})]
        for name, given in {
            "dropped": {"dropped": 0.4},
            "latency": {"latency": "40 ms"},
            "noise": {"noise": 0.5},
            "occlusion": {"marks": [0], "start": "0.1 s", "end": "0.3 s"},
            "outliers": {"outliers": 0.3, "outlier_size": 20.0},
            "period": {"period": "80 ms"},
            "quantisation": {"quantisation": 1.0},
        }.items()
    },
    **{
        f"joint effect {name}": [imperfect("actuation", {"kind": name, **given}, ARM_SERVO)]
        for name, given in {
            "encoder": {"encoder": "1 deg"},
            "lag": {"lag": "0.1 s"},
            "velocity": {"velocity": "0.1 rad/s"},
            "acceleration": {"acceleration": "0.5 rad/s^2"},
        }.items()
    },
    **{
        f"drive {name}": [(*powered({"kind": name, **given}), OF_DRIVE)]
        for name, given in {
            "velocity_loop": {},
            "position_loop": {},
            "gravity_compensated_pd": {},
            "computed_torque": {},
            "industrial_servo": {},
        }.items()
    },
    "DriveModel": [
        (
            powered({"kind": "computed_torque", "model": {"mass": 0.9}}, payloads=[LOAD])[0],
            ("actuation", "drive", "model"),
        )
    ],
    "Payload": [
        (
            powered("computed_torque", payloads=[LOAD])[0],
            ("actuation", "payloads", 0),
            {"on": ["panda.hand"], "attached": ["0.1 s"], "released": ["0.2 s"]},
        )
    ],
    "PoseTable": [
        linked("place", {"position": "1, 2, 3 cm", "rpy": "0, 0, 10 deg"}),
        linked("place", {"rotvec": "0, 0, 10 deg"}),
        (*linked("place", {"rotation": TURN}), {"rotation": [[[1, 0, 0], [0, 1, 0], [0, 0, 1]]]}),
    ],
    "FeatureBlock": [(*part("features", [BLOCK, "log_depth"], index=0), OF_BLOCK)],
    "GoalTable": [
        part("goal", {"q": [f"{x:.9f} rad" for x in HOME]}, ARM),
        (PLACED, ("task", "goal")),
        part("goal", GOAL),
        part("goal", {"s": [0.01 * i for i in range(12)]}),
        (*part("goal", KEPT, ARM), {"places": [MOVED]}),
        (
            part("features", "luminance", PICTURED, **{**SERVO, "goal": PHOTOGRAPHED})[0],
            ("task", "goal"),
            {"picture": [f"{LENSES}/b.png"]},
        ),
    ],
    "BodyPlace": [
        (part("goal", KEPT, ARM)[0], ("task", "goal", "places", 0), {"name": ["camera"]})
    ],
    "StartTable": [(ARM_SERVO, ("start",)), (PLACED, ("start",))],
    "StraightTable": [
        (reaching(path={**STRAIGHT, **pace})[0], ("task", "path"))
        for pace in ({"duration": "0.5 s"}, PACE)
    ],
    "SpeedLimit": [part("limit", {key: x}, ARM) for key, x in SLOW.items()],
    "Phase": [
        (mission(), ("task", "phases", 0), {"expects": [["converged"]]}),
        (mission(), ("task", "phases", 1), OF_PHASE),
        (hanging(), ("task", "phases", 0), {"attach": [{}]}),
        (hanging(), ("task", "phases", 1)),
    ],
    "ExperimentTable": [(WHOLE, (), OF_WHOLE), (STUDIED, ())],
    "Scene": [(WHOLE, (), OF_WHOLE), (DEVELOPED, (), {"light": [{"ambient": 0.3}]})],
    "RobotTable": [
        (*linked("dh", ROW)[:1], ("robots", 0), OF_ROBOT),
        (WHOLE, ("robots", 0), {"name": ["other"], "model": ["planar_2r"]}),
    ],
    "ToolTable": [(TOOLED, ("robots", 0, "tools", 0), OF_TOOL)],
    "LinkTable": [
        (*linked("parent", "a")[:1], ("robots", 0, "links", 2), OF_LINK),
        (*linked("dh", ROW)[:1], ("robots", 0, "links", 2)),
        (*weighed("parent", "a")[:1], ("robots", 0, "links", 2), OF_LINK),
        (*car("rolling")[:1], ("robots", 0, "links", 1)),
        (with_random_starts(*linked("parent", "a")[:2], "b")[0], ("robots", 0, "links", 2)),
        (*rail({"kind": "arc", "radius": "1 m", "angle": "1 rad"})[:1], ("robots", 0, "links", 1)),
        (*mimicking({"kind": "mimic", "of": "a", "ratio": 2.0})[:1], ("robots", 0, "links", 3)),
    ],
    "DHRow": [linked("dh", ROW)],
    "InertiaTable": [
        weighed("inertia", {"mass": "1 kg", "moments": "1, 1, 1 kg m^2"}),
        weighed("inertia", {"mass": "1 kg", "moments": "1, 1, 3 kg m^2", "strict": False}),
    ],
    "Steering": [steered()],
    "ObjectText": [
        (WHOLE, ("objects", 0), {"name": ["a"], "on": ["world"]}),
        (solid(BALL)[0], ("objects", 1)),
        targeted("tag", TAG)[:2],
        targeted("board", BOARD)[:2],
        targeted("dots", DOTS),
    ],
    "Tag": [aimed("tag", TAG)],
    "Board": [aimed("board", BOARD)],
    "DotPattern": [aimed("dots", DOTS)],
    "CalibrationFile": [
        calibrated({"file": f"{LENSES}/a.xml"}, file=[f"{LENSES}/b.xml"], sha256=["0" * 64]),
        calibrated({"file": f"{LENSES}/cameras.txt", "camera": "1"}, camera=["2"]),
        calibrated(STORED, distortion=[[0.1, 0.0, 0.0, 0.0]], lens=["fisheye"]),
    ],
    "CameraTable": [
        (WHOLE, ("cameras", 0), OF_CAMERA),
        (BY_MATRIX, ("cameras", 0), OTHER_K),
        (calibrated({"file": f"{LENSES}/a.xml"})[0], ("cameras", 0), OTHER_FILE),
    ],
    "Light": [({**DEVELOPED, "light": {"ambient": 0.3}}, ("light",))],
    "Optics": [(DEVELOPED, ("cameras", 0, "optics"))],
    "Motion": [(WHOLE, ("motions", 0), {"robot": ["drone"]})],
    "Sensing": [(*top("sensing", {"outliers": 0.3}), OF_SENSING)],
    "Occlusion": [
        (world(WHOLE, sensing=HIDDEN), ("sensing", "occlusions", 0), {"camera": ["second"]})
    ],
    "Actuation": [
        (world(ARM_SERVO, actuation={}), ("actuation",), OF_ACTUATION),
        (
            powered("computed_torque")[0],
            ("actuation",),
            {"payloads": [[LOAD]], "step": ["5 ms"], "gravity": ["0, 0, -1.6 m/s^2"]},
        ),
    ],
    "Safety": [
        (
            world(ARM_SERVO, safety={"ramp": "0.2 s"}, sensing={"dropped": 0.6}),
            ("safety",),
            OF_SAFETY,
        ),
        (
            world(ARM_SERVO, safety={"fence": NEAR, "acceleration": "1 rad/s^2"}),
            ("safety",),
            {"call_interval": ["0.2 s"]},
        ),
    ],
    "RosConnection": [(world(ARM_SERVO, ros2={}), ("ros2",), OF_CONNECTION)],
    "Fence": [(world(ARM_SERVO, safety={"fence": FENCE}), ("safety", "fence"), HIGH)],
    "Watchdog": [
        (
            world(ARM_SERVO, safety={"watchdog": {"after": "50 ms"}}, sensing={"dropped": 0.6}),
            ("safety", "watchdog"),
        )
    ],
    "RunTable": [
        (world(WHOLE, sensing={"noise": 1.0}), ("run",)),
        (task("ibvs", tolerance=0.7)[0], ("run",)),
    ],
    "StudyTable": [(STUDIED, ("study",), OF_STUDY)],
}


def place(noun, name):
    """The case of a kind that belongs to a family without a recipe."""
    key = {"feature": "features", "interaction matrix": "interaction"}.get(noun, noun.split()[0])
    if noun in ("feature", "law", "inverse", "interaction matrix", "secondary motion"):
        return [part(key, {"kind": name}, ARM if noun == "inverse" else FLYING)]
    raise LookupError(f"no recipe for the {noun} {name!r}: add one to tests/recipes.py")


def recipes(label):
    """The cases of a kind, such as "law camera", or of another class by its name."""
    found = RECIPES.get(label)
    if found is None:
        found = place(*label.rsplit(" ", 1))
    return [
        Case(tables, path, {**OTHERS, **(others[0] if others else {})})
        for tables, path, *others in found
    ]
