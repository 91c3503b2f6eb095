"""Formats of robots and of data sets for them: ROS bags, MCAP, PX4 ULog, EuRoC, TUM, KITTI OXTS."""
