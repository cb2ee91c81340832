"""Start the robot, or its twin, in this ROS graph: `ros2 launch vla_deploy robot.launch.py`.

It runs `vla-deploy run --ros`, which starts every process of the robot, and among them the gateway.
Only the gateway needs ROS. The others run in an environment of their own, so ROS's Python folders
and libraries are hidden from them here.

What the robot gets is handed over by variables of the environment:

    VLA_DEPLOY_ROS_WORKSPACE    the installation that this file lies in; its setup.bash is sourced
                                for the gateway, after the one of ROS. The robot file's [ros]
                                workspace goes before it.
    VLA_DEPLOY_ROS_PARAMS_FILE  params_file: a file of YAML parameters for the whole robot
    VLA_DEPLOY_ROS_VLM_API_KEY  vlm_api_key, if it is not empty: it goes before the one in the file;
                                on a command line of the robot's anyone could read it.

The end of the launch ends the robot in order: Ctrl-C is passed on, and the robot gets the time to
bring its arms down before it is killed. The end of the robot ends the launch.
"""

from pathlib import Path

from ament_index_python.packages import get_package_prefix, get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration

PACKAGE = "vla_deploy"
# Bringing the arms down and stopping every process in turn takes longer than launch's own 5 s.
SIGTERM_AFTER_S = "60"
SIGKILL_AFTER_S = "30"
# Name, default, description.
ARGUMENTS = (
    ("robot", "butler", "name or folder of the robot"),
    ("profile", "", "platform profile; empty: the chosen or detected one"),
    ("twin", "false", "true replaces the hardware by the twin"),
    ("world", "flat", "world of the twin"),
    ("seed", "0", "where the objects of the twin lie"),
    ("viewer", "false", "true shows the twin in a window"),
    ("arm", "", "true or false; empty: armed once ready, if it is the twin"),
    ("params_file", "", "YAML parameters; empty: config/cognitive_robot.yaml of this package"),
    ("vlm_api_key", "", "key of the provider that vlm_provider names"),
    ("vla_deploy", "vla-deploy", "the command of the stack"),
)


def generate_launch_description() -> LaunchDescription:
    """Describe the launch: its arguments, and the robot."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, default, text in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=start_robot)])


def start_robot(context: LaunchContext) -> list[ExecuteProcess]:
    """Return the process of the robot for the arguments that were given."""
    given = {name: LaunchConfiguration(name).perform(context) for name, _, _ in ARGUMENTS}
    return [
        ExecuteProcess(
            cmd=command_of(given),
            additional_env=environment_of(given),
            name="robot",
            output="screen",
            sigterm_timeout=SIGTERM_AFTER_S,
            sigkill_timeout=SIGKILL_AFTER_S,
            on_exit=Shutdown(reason="the robot has ended"),
        )
    ]


def command_of(given: dict[str, str]) -> list[str]:
    """Return the command line.

    Raises:
        ValueError: an argument is neither true nor false where it must be.
    """
    command = [given["vla_deploy"], "run", "--ros", "--robot", given["robot"]]
    command += ["--world", given["world"], "--seed", given["seed"]]
    if given["profile"]:
        command += ["--profile", given["profile"]]
    if is_true("twin", given["twin"]):
        command.append("--twin")
    if is_true("viewer", given["viewer"]):
        command.append("--viewer")
    if given["arm"]:
        command.append("--arm" if is_true("arm", given["arm"]) else "--no-arm")
    return command


def environment_of(given: dict[str, str]) -> dict[str, str]:
    """Return what is handed over to the robot, and hide ROS from the other processes."""
    prefix = Path(get_package_prefix(PACKAGE))
    # A workspace has one setup.bash for all its packages: above their prefixes, or among them.
    installation = prefix if (prefix / "setup.bash").is_file() else prefix.parent
    default = Path(get_package_share_directory(PACKAGE), "config", "cognitive_robot.yaml")
    handed_over = {
        "VLA_DEPLOY_ROS_WORKSPACE": str(installation),
        "VLA_DEPLOY_ROS_PARAMS_FILE": str(Path(given["params_file"] or default).absolute()),
        "PYTHONPATH": "",
        "LD_LIBRARY_PATH": "",
    }
    if given["vlm_api_key"]:
        handed_over["VLA_DEPLOY_ROS_VLM_API_KEY"] = given["vlm_api_key"]
    return handed_over


def is_true(name: str, text: str) -> bool:
    """Read an argument that is true or false.

    Raises:
        ValueError: it is neither.
    """
    if text.lower() not in ("true", "false"):
        raise ValueError(f"launch argument {name}: expected true or false, got {text!r}")
    return text.lower() == "true"
