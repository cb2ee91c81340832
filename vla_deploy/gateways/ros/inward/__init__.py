"""Take what the ROS graph asks for, to the same judges as everything else."""
