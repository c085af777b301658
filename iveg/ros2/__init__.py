"""The language of ROS 2: messages, their bytes, and names on DDS; no I/O."""
