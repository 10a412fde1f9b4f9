"""Stages of control laws, task priorities, weights, command limits and trajectories."""
