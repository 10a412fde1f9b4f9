"""Stages of rigid-body dynamics: placement, torques, mass matrices, accelerations and drives."""
