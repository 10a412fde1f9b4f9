"""Outcomes of runs, and the tables in which what happened is kept."""
