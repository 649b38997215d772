"""The link to a rig, what it is made to do, and what it says: ports, motions, captures."""
