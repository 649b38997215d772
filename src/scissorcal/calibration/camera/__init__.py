"""The camera: bundle adjustment over a board's corners, its uncertainty, the fit."""
