"""Kinds of joint, each in a file of its own, and the ways in which coordinates follow others."""
