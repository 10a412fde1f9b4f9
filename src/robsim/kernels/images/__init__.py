"""Images: what a camera sees, and how that is disturbed, hidden and delayed."""
