"""What the robot senses: beacon, lidar, odometry; laws and systems."""
