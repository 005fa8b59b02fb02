# SPDX-License-Identifier: Apache-2.0
"""Starts `prescene serve` with `ros2 launch`, beside the robot's other nodes.

    ros2 launch /usr/share/prescene/launch/prescene.launch.py scene:=table.yaml
    ros2 launch /usr/share/prescene/launch/prescene.launch.py --show-args

The program is the one that the shell would find; it is no part of a ROS package. Ctrl-C ends it as in a shell, so that a
recording is closed.
"""
import os
import shlex
import sys

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

# The releases in whose form the node can announce itself.
DISTROS = ('humble', 'jazzy')

# Of `prescene serve`: an option with a value is left out where the value is empty.
ARGUMENTS = {
    'scene': 'Scene file: models, supports, robot, objects.',
    'domain': 'DDS domain; empty = that of ROS_DOMAIN_ID, else 0.',
    'record': 'Recording to write (MCAP); empty = none.',
    'camera': 'Whose driver gives the topics their names: realsense, zed, orbbec or azure; empty = the defaults.',
    'learned': 'File in which what is learned of friction, mass, ... is kept; empty = none.',
}


def command(value_of):
    """The words of the command, of a function from an argument's name to its value."""
    words = ['prescene', 'serve']
    for name in ARGUMENTS:
        if value_of(name):
            words += ['--' + name, value_of(name)]
    sim_time = value_of('use_sim_time').lower()
    if sim_time not in ('true', '1', 'false', '0'):
        raise ValueError(f"use_sim_time is '{value_of('use_sim_time')}': give true or false")
    if sim_time in ('true', '1'):
        words.append('--use-sim-time')
    # Without it, `ros2 node list` and `ros2 param` don't see the node.
    distro = os.environ.get('ROS_DISTRO', '')
    if distro in DISTROS:
        words += ['--ros-distro', distro]
    elif distro:
        print(f'prescene.launch.py: ROS_DISTRO is {distro}, not one of {", ".join(DISTROS)}: '
              'topics work, but `ros2 node list` will not show the node', file=sys.stderr)
    return words + shlex.split(value_of('options'))


def start(context):
    words = command(lambda name: LaunchConfiguration(name).perform(context))
    # Seconds to close a recording in, before it is killed.
    return [ExecuteProcess(cmd=words, name='prescene', output='screen', sigterm_timeout='10')]


def generate_launch_description():
    declared = [DeclareLaunchArgument('scene', description=ARGUMENTS['scene'])]
    declared += [DeclareLaunchArgument(name, default_value='', description=text)
                 for name, text in ARGUMENTS.items() if name != 'scene']
    declared += [
        DeclareLaunchArgument('use_sim_time', default_value='false', description='Time is simulated, and comes on /clock.'),
        DeclareLaunchArgument('options', default_value='', description='More options of `prescene serve`, as in a shell.'),
    ]
    return LaunchDescription(declared + [OpaqueFunction(function=start)])
