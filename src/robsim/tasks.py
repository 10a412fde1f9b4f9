"""Servo tasks, their goals, and the conditions that switch between tasks."""

from robsim.run.mission import Mission as Mission
from robsim.run.mission_run import MissionRun as MissionRun
from robsim.run.phase import Phase as Phase
from robsim.servo.goals.body_place import BodyPlace as BodyPlace
from robsim.servo.goals.goal import GoalFeatures as GoalFeatures
from robsim.servo.goals.goal import GoalPose as GoalPose
from robsim.servo.goals.goal import TaughtGoal as TaughtGoal
from robsim.servo.tasks.conditions import ErrorBelow as ErrorBelow
from robsim.servo.tasks.conditions import NearBorder as NearBorder
from robsim.servo.tasks.docking_task import Docking as Docking
from robsim.servo.tasks.follow_joints import FollowJoints as FollowJoints
from robsim.servo.tasks.follow_path import FollowPath as FollowPath
from robsim.servo.tasks.parallel import Parallel as Parallel
from robsim.servo.tasks.placing_task import Placing as Placing
from robsim.servo.tasks.priorities import Priorities as Priorities
from robsim.servo.tasks.schemes import IBVS as IBVS
from robsim.servo.tasks.schemes import PBVS as PBVS
from robsim.servo.tasks.schemes import Hybrid as Hybrid
from robsim.servo.tasks.schemes import Partitioned as Partitioned
from robsim.servo.tasks.switch import Switch as Switch
from robsim.servo.tasks.task import ServoTask as ServoTask
