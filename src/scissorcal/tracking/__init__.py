"""The plate's pose while rig and plate work: a filter over pictures and contacts.

Arrays in, arrays out: no files, no ports, no clocks. `PoseTracker` is the filter;
`PoseFollower` feeds it from a camera and a rig whose clocks it measures. 'scissorcal track' and
`scissorcal.workday.runs.track.track_plate` connect it to a workspace.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
