"""Figures of studies: many runs, a dot, a share or a distribution of them."""
