"""Drive ODrive axes over their CANSimple protocol."""
