"""A package in a browser: what the page is told, the page itself, the local server."""
