"""The day's work in one workspace: what is there, what comes next, and every step of it."""
