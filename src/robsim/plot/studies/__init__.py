"""Figures of studies: runs as dots, and their counts and distributions."""
