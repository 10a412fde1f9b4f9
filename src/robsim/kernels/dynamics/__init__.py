"""Compiled stages of the dynamics of rigid bodies, and of the drives of joints."""
