"""The plate's pose: the fit to photographs of its target, and its checks."""
