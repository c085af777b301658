"""The language of ROS 2: messages, their bytes, and names on DDS; no I/O.

Layouts are those of ROS 2 Humble and later (``vision_msgs`` 4); units and frames those
of REP-103 and REP-105.
"""
