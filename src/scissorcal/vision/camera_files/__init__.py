"""Camera files: read from other tools, written for OpenCV and ROS."""

from scissorcal.vision.camera_files.reading import (
    CameraFile,
    Style,
    read_camera_file,
    write_camera_file,
)

__all__ = ["CameraFile", "Style", "read_camera_file", "write_camera_file"]
