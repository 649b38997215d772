"""The demo's day on a virtual rig, and its rendered photographs."""
