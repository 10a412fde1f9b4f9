"""The network side of a studio: an HTTP server with a page, downloads, and a WebSocket per page."""
