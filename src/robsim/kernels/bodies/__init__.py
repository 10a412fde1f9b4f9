"""Forward kinematics of kinematic trees and integration of their coordinates."""
