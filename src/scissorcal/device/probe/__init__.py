"""The first touch of a rig: what it is checked for before a motor runs."""
