"""Outcomes of runs, and the tables that record the runs."""
