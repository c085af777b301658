"""Simulated greenhouse: robots and people of a scenario, in real time over MQTT."""
