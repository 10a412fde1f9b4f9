"""The network side of a studio: a page, files, and a conversation with each page."""
