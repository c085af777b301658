"""A robot that speaks ROS 2: from its topics to Algorithm 1, from Algorithm 3 to them.

Pure but for ``rig``: bytes and times come in as arguments, frozen values go out.
"""
