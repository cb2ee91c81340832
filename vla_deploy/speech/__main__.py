"""Run the speech process: `python -m vla_deploy.speech --run-dir D --robot butler`."""

import sys
from typing import Final

from drivers.audio.open_audio import open_audio_input, open_audio_output
from platforms import load_profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.robots import load_robot
from vla_deploy.robots.links import device_links
from vla_deploy.runtime.executors import worker_thread
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main
from vla_deploy.speech.microphone import linked
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.stop_words.listener import PAGE, build_stop_words
from vla_deploy.speech.voice.robot_voice import build_voice

SYNTHESIS_S: Final = 0.1
RECOGNITION_S: Final = 0.25
"""What a sentence takes, of simulated time."""
LOADING_S: Final = 1.0


def build(context: NodeContext) -> SpeechNode:
    """Build the node from what the process was started with."""
    robot = load_robot(context.robot)
    links = device_links(robot, context.devices_dir)
    profile = load_profile(context.profile)
    clock = context.clock
    speaker = linked(robot.speaker, open_audio_output, links, clock)
    voice = build_voice(robot.voice, speaker, clock, worker_thread("voice", clock, SYNTHESIS_S))
    return SpeechNode(
        context,
        robot,
        profile,
        linked(robot.microphone, open_audio_input, links, clock),
        worker_thread("recogniser", clock, RECOGNITION_S),
        worker_thread("loader", clock, LOADING_S),
        voice=voice,
        stop_words=build_stop_words(context, profile),
        page_stop_words=build_stop_words(context, profile, place=PAGE),
    )


if __name__ == "__main__":
    sys.exit(main("speech", build, mendable=(InferenceError,)))
