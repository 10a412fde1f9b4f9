"""Compiled stages, programs of stages, lanes, memory, and the cache of machine code."""
