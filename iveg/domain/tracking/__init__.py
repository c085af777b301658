"""From what single pictures show to the same people over time (multi-object tracking).

Two layers that never mix: *sightings* protect, *tracks* name.  A sighting is replaced
only by its own observer's next look at the same spot; which track it belongs to is a
label, so a wrong label can neither add a ring nor take one away.
"""
