"""From detections of single pictures to persons over time (multi-object tracking).

Two layers never mix:  *sightings* protect, *tracks* name.  A sighting is replaced only
by its own observer's next sighting of the same spot; the track that it belongs to is a
label, so a wrong label can neither add a zone nor take one away.
"""
