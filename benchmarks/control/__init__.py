"""What contact adds to a camera: the pose's errors and the control's, measured in simulation."""
