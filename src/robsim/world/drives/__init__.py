"""Drives, which compute the torques of joints from velocity commands."""
