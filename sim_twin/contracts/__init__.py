"""State what every device of a kind must do, as test classes that any form of it inherits.

Each module holds one contract: subclass it in a test module and give it a `bench`. Failed
assertions are explained there as in any test.
"""

import pytest

for _name in ("sensors", "lidar", "imu", "camera", "estop", "audio", "servo_bus", "drive_bus"):
    pytest.register_assert_rewrite(f"{__name__}.{_name}")
