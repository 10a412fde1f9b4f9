"""The geometry of images: cameras, poses, homographies and triangulation."""

from robsim.vision.plane import HomographyMotions as HomographyMotions
from robsim.vision.plane import decompose_homography as decompose_homography
from robsim.vision.plane import estimate_homography as estimate_homography
from robsim.vision.pose_estimation import PoseEstimate as PoseEstimate
from robsim.vision.pose_estimation import estimate_pose as estimate_pose
from robsim.vision.stereo import Triangulation as Triangulation
from robsim.vision.stereo import triangulate as triangulate
