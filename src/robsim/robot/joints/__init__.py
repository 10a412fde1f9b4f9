"""The kinds of joint, one in each file, and the ways in which coordinates follow others."""
