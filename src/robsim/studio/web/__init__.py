"""The network side of a studio: an HTTP server for a page, downloads and WebSockets."""
