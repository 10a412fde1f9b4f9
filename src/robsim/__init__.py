"""RobSim: model, simulate and see robots that are guided by cameras.

>>> import robsim as rs
>>> experiment = rs.load_scenario(rs.examples.path("chapter_6_1"))
>>> rs.Outcome(experiment.run().outcome.item()).name
'CONVERGED'

Scenes
    Scene          Robots, objects and cameras, and the frames that they stand on.
    Robot          A tree of links with joints: from DH rows, from URDF, or from the library.
    Object         A body in the scene, with feature points on it.
    Camera         A pinhole camera: intrinsics, size of the image, distortion.
    MountedCamera  A camera on a robot, on an object, or fixed in the world.
    Motion         The prescribed motion of an object or a robot.
    Pose           The pose of one frame in another frame.
    Block          A box.
    Wheel          A wheel.
    CameraBody     The housing of a camera.

Experiments
    Experiment     A scene, a task, a start, imperfections and settings, as one value.
    Mission        Phases, each with a task, that follow one another.
    Phase          One task of a mission.
    Sensing        Imperfections of the images: noise, delay, outliers, occlusions.
    Actuation      Imperfections of the joints: lag, limits, encoders.
    Safety         Limits of the command: speeds, fences, watchdog.
    Outcome        The reason why a run ended.
    Controller     The controller of an experiment, for a real robot or your own loop.
    load_scenario  Read an experiment from a scenario file.
    simulate       Close the loop from a start, and return the run.
    replay         Simulate a stored run again.
    save_run       Write a run to a file.
    open_run       Open a run that `save_run` wrote.

Tasks
    IBVS           Image-based visual servoing.
    PBVS           Position-based visual servoing.
    Hybrid         Hybrid (2 1/2 D) visual servoing.
    Partitioned    Partitioned visual servoing: motion about the optical axis treated apart.
    Placing        Placing of a camera from the image of a triangle, as in the chapter.
    Docking        Docking of a vehicle at a target.
    FollowJoints   Motion of joints along a trajectory.
    FollowPath     Motion of a frame along a path.
    Priorities     Tasks in order of priority.
    Parallel       Tasks of different robots at the same time.
    Switch         Tasks between which a condition switches.
    GoalPose       A goal as the pose of the camera.
    GoalFeatures   A goal as values of the features.

Studies and analysis
    study          Simulate an experiment many times, with varied numbers and starts.
    open_study     Open the result of a study on disk.
    bench          Compare schemes on suites of starts.
    compare        Compare schemes on one scene.
    advise         Predict the behaviour of an experiment near its goal.
    diagnose       Measure how a run departs from the behaviour that its law intends.
    explain        Explain why a run ended as it did.
    equilibria     Find the equilibria of a task.
    calibrate      Calibrate a camera on a robot.

Pages
    show           Show a run, a scene or a robot in the browser.
    export_html    Write a page that shows a run, a scene or a robot.

Errors
    RobSimError    The base class of all errors of RobSim.

Modules by subject
    analysis       Results of comparisons, advice, explanations and equilibria.
    calibration    Calibration of lenses and mounts.
    constraints    Constraints on the command of a law.
    control        Control of a real robot: commands, health, limits, ROS 2 messages.
    declare        Declaration of your own features, laws, joints and other kinds.
    drives         Drives, which move joints by torques, and their loads.
    endings        Conditions that end a run.
    errors         Errors and warnings.
    examples       Example scenarios.
    features       Visual features.
    imperfections  Imperfections of sensors and actuators.
    joints         Links, joints and joint kinds.
    kinematics     Inverse kinematics, manipulability, workspace, clearance.
    laws           Control laws and their parts.
    logs           ROS 2 bags, CSV and Parquet tables, data frames.
    plot           Figures and films.
    robots         Library of robots.
    samplers       Samplers of numbers and choices.
    shapes         Shapes of bodies, inertia, curves of rails.
    starts         Samplers of start configurations.
    studies        Results of studies and benchmarks.
    tasks          Servo tasks, goals and switching conditions.
    testing        Checks of your own features, laws and joints.
    trajectory     Trajectories of joints and frames.
    units          Units of length, angle and time.
    vision         Poses from images, homographies, triangulation, tags, boards.
    weights        Weightings of feature points.
"""

import sys
from importlib import import_module
from typing import Any

from robsim.base.lazy_names import attach_names

__version__ = "0.2.0"

__getattr__, __dir__, _ = attach_names(__name__, __file__)
__all__: list[
    str
] = []  # names are used as `rs.Scene`; with a list, `help(rs)` would print all of them
_SHOWN = {
    "robsim.files.flat_table": "RunDataset",
    "robsim.run.mission_run": "MissionRun",
    "robsim.world.scene": "Scene",
    "robsim.robot.robot": "Robot",
    "robsim.run.experiment": "Experiment",
    "robsim.studies.study_result": "StudyResult",
}


def _shown_in_notebooks() -> None:
    """Let IPython, where it runs, show pages with pictures, as `build_notebook_bundle` does."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is None:
        return
    bundles = shell.display_formatter.mimebundle_formatter
    for module, name in _SHOWN.items():
        bundles.for_type_by_name(module, name, _page)


def _page(shown: Any, **options: Any) -> dict[str, str]:
    export = import_module(f"{__name__}.page.export")
    bundle: dict[str, str] = export.build_notebook_bundle(shown)
    return bundle


_shown_in_notebooks()
