"""From photographs to geometry: targets, detection, the camera, the blade, the plate."""
