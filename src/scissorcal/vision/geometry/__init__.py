"""Cameras and poses: projection, the pose of a board, the frame of the rig."""
