"""The studio: a live simulation in the browser, and who may see it."""
