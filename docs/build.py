"""Write what follows from the code: docs/reference.md, docs/kinds.md, lists in docs/scenario.md.

python docs/build.py            writes them
python docs/build.py --check    exit status 1 if they are not up to date
"""

import inspect
import re
import sys
from pathlib import Path

import robsim as rs
from robsim.declare.document import format_markdown_table
from robsim.declare.kind_families import families
from robsim.robot.link_table import LinkTable
from robsim.robot.robot_table import RobotTable
from robsim.run.experiment_text import ExperimentTable, RunTable
from robsim.run.start_table import StartTable
from robsim.world.mounted_camera import CameraTable

HERE = Path(__file__).parent
# the public names, by what a user looks for
GROUPS = {
    "Experiments and runs": "Experiment load_scenario simulate replay save_run open_run "
    "table Outcome Interrupted Region TooClose Ending Moment Mission "
    "Phase MissionRun examples",
    "Driving a robot": "Controller DriveCommand Health Marks Safety Fence Watchdog RosMessages",
    "Logs": "save_bag open_bag bag_images BagImage read_log",
    "Robots": "Robot robots Link DHRow Joint JointKind Mimic Chord Ackermann Rolling Steering "
    "IKResult IKReason ClosedIK manipulability condition_number singularity_distance workspace "
    "Workspace",
    "Shapes, poses, curves": "Pose Block Wheel Ball Capsule TaperedCylinder CameraBody "
    "Mesh Inertia curves units clearance",
    "Scenes and cameras": "Scene Object MountedCamera Camera Visibility Motion",
    "Tags and boards": "Tag Board Detector render",
    "Calibration": "calibrate Calibration CalibrationViews observe viewpoints NextPoses "
    "CalibrationCost hand_eye robot_world calibrate_lens LensCalibration",
    "Imperfection": "Sensing Occlusion Actuation",
    "Servo tasks": "IBVS PBVS Hybrid Partitioned Placing Docking ServoTask Priorities Switch "
    "Parallel ErrorBelow NearBorder",
    "Goals": "TaughtGoal GoalPose GoalFeatures",
    "Features": "FeatureBlock Points PixelPoints Polar Spherical LogDepth Points3D StereoPoints "
    "Segments Lines VanishingPoint Ellipse Sphere RegionMoments PointMoments DecoupledMoments "
    "ThetaU Translation Observation",
    "Laws and what they are made of": "JointLaw CameraLaw PartitionedLaw ControlState "
    "PseudoInverse DampedInverse JacobianTranspose AdaptiveGain Broyden DepthFilter "
    "EstimatedMotion",
    "What makes a mark count less": "Border Fade Huber Tukey Cauchy",
    "What is done to a command": "SpeedLimit AvoidLimits Posture LargeProjection",
    "Trajectories": "FollowJoints FollowPath trajectory",
    "Estimation from images": "estimate_pose PoseEstimate triangulate Triangulation homography "
    "decompose_homography HomographyMotions",
    "Studies": "study open_study Study Counts Uniform Normal LogUniform Sobol Choice Grid Plus "
    "Times Given Sampler LookAt Shell Within About Anywhere",
    "Analysis": "advise Advice compare Comparison bench Benchmark Suite diagnose explain "
    "Explanation equilibria Equilibria Equilibrium",
    "Pages and films": "export_html show open_recording Recording animate",
    "Figures": "plot",
    "Your own parts": "declare testing",
    "The chapter": "classic",
    "Errors and warnings": "RobSimError InputError UnitError FrameError GoalError FileError "
    "RankWarning UnitWarning FileWarning FitWarning ReplayWarning",
}
TABLES = {
    "A whole file": ExperimentTable,
    "`[start]`": StartTable,
    "`[run]`": RunTable,
    "`[sensing]`": rs.Sensing,
    "`[[sensing.occlusions]]`": rs.imperfections.Occlusion,
    "`[actuation]`": rs.Actuation,
    "`[safety]`": rs.Safety,
    "`[safety.fence]`": rs.control.Fence,
    "`[safety.watchdog]`": rs.control.Watchdog,
    "`[[robots]]`": RobotTable,
    "`[[robots.links]]`": LinkTable,
    "`[[objects]]`": rs.Object,
    "`[[cameras]]`": CameraTable,
    "`[[motions]]`": rs.Motion,
}


def first_sentence(name: str) -> str:
    """Return the first line of a docstring."""
    text = inspect.getdoc(getattr(rs, name)) or ""
    return text.split("\n", 1)[0]


def reference() -> str:
    """Return the page of all public names."""
    lines = [
        "# Reference",
        "",
        "Every public name of `robsim`, by what it is for. `help(robsim.NAME)` says all of it.",
        "This page is written by `docs/build.py`.",
    ]
    for title, names in GROUPS.items():
        lines += ["", f"## {title}", "", "| name | |", "| --- | --- |"]
        lines += [f"| `{name}` | {first_sentence(name)} |" for name in names.split()]
    return "\n".join(lines) + "\n"


def kinds() -> str:
    """Return the page of all tables that a scenario file may hold."""
    lines = [
        "# Tables of a scenario file",
        "",
        "What may stand in each table of a scenario file, as the classes declare it: every kind",
        "that RobSim brings, with its keys. The same names are the dotted names of `--set`,",
        "`--vary` and `Experiment.at`. This page is written by `docs/build.py`;",
        "[scenario.md](scenario.md) explains and shows the tables.",
    ]
    for title, kind in TABLES.items():
        lines += ["", f"## {title}", "", format_markdown_table(kind)]
    for noun, family in sorted(families().items()):
        lines += ["", f"## {noun.capitalize()}s", ""]
        for name, kind in family.kinds.items():
            about = (inspect.getdoc(kind) or "").split("\n", 1)[0]
            lines += [
                f"### `{name}`",
                "",
                f"`{kind.__name__}`: {about}",
                "",
                format_markdown_table(kind),
                "",
            ]
    return "\n".join(lines).rstrip() + "\n"


def scenario() -> str:
    """Return the page on scenario files with the kinds of some families, where it marks them."""

    def listed(mark: re.Match[str]) -> str:
        names = ", ".join(f'"{name}"' for name in families()[mark[1]].names)
        return f"<!-- kinds: {mark[1]} -->{names}<!-- -->"

    return re.sub(r"<!-- kinds: (.*?) -->.*?<!-- -->", listed, _read(HERE / "scenario.md"))


def main() -> int:
    """Write or check the pages."""
    pages = {"reference.md": reference(), "kinds.md": kinds(), "scenario.md": scenario()}
    stale = [name for name, text in pages.items() if _read(HERE / name) != text]
    if "--check" in sys.argv:
        print(*[f"docs/{name} is not up to date: python docs/build.py" for name in stale], sep="\n")
        return int(bool(stale))
    for name in stale:
        (HERE / name).write_text(pages[name], encoding="utf-8")
    return 0


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.exists() else ""


if __name__ == "__main__":
    sys.exit(main())
