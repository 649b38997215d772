"""The blade's edge: photographed points in cells, candidate families, the fit."""
