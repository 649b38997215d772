"""Blades in photographs: from a silhouette to an edge in the plane of the mat."""
