"""Figures of studies, as Matplotlib figures."""
