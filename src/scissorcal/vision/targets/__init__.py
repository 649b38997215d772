"""Printed targets: their layout, their sheets, and their corners in photographs."""
