"""One function a step of the day: capture, fit, verify, report, sign, package, render."""
