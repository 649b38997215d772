"""The front end of every fit: what a recording is split into, checked for and filtered to."""
