"""Cuts and presses: response, fracture and ripple, over the path."""
