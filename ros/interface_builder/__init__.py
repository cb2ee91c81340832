"""Build ROS 2 interface packages against the wheels of ROS, without colcon and CMake."""
