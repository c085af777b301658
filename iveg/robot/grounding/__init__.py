"""From a detector's mask and a depth picture to a box in metres: the paper's grounding.

``mask`` says which pixels are the target, ``cloud`` where those pixels are,
``locate`` puts the two together and into the robot's or the map's frame.
"""
