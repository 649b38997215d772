"""A virtual rig: everything that a real one does on its port, from laws that are known exactly."""
