"""ROS 2 side of a robot: topics to Algorithm 1, and Algorithm 3 to topics.

Without I/O except ``rig``: bytes and times are arguments, frozen values are returned.
"""
