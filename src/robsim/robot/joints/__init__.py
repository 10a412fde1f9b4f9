"""Kinds of joint, one in each file, and couplings between coordinates."""
