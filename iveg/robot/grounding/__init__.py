"""From a detector's mask and a depth picture to a box in metres: the paper's grounding.

``mask`` computes the target's pixels, ``cloud`` their points, and ``locate`` combines
both and transforms the result into the robot's or the map's frame.
"""
