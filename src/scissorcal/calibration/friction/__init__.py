"""Friction: the law over windows, its terms, the fit, its checks and predictions."""
