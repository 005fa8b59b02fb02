# SPDX-License-Identifier: Apache-2.0
"""launch_test.py <folder of the launch file> <program>: see launch_test.sh."""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import types


class Recorded:
    """An action of `launch`: what it was made with."""

    def __init__(self, *args, **named):
        self.args, self.named = args, named


class DeclareLaunchArgument(Recorded):
    pass


class ExecuteProcess(Recorded):
    pass


class OpaqueFunction(Recorded):
    pass


class LaunchDescription(Recorded):
    pass


class LaunchConfiguration(Recorded):
    def perform(self, context):
        return context[self.args[0]]


def stub(name, *members):
    sys.modules[name] = types.ModuleType(name)
    for member in members:
        setattr(sys.modules[name], member.__name__, member)


stub('launch', LaunchDescription)
stub('launch.actions', DeclareLaunchArgument, ExecuteProcess, OpaqueFunction)
stub('launch.substitutions', LaunchConfiguration)


def load(path):
    spec = importlib.util.spec_from_file_location('launched', path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def check(holds, *what):
    if not holds:
        sys.exit(' '.join(str(part) for part in what))


folder, program = pathlib.Path(sys.argv[1]), sys.argv[2]
module = load(folder / 'prescene.launch.py')
actions = module.generate_launch_description().args[0]
declared = {action.args[0]: action.named for action in actions if isinstance(action, DeclareLaunchArgument)}
check([name for name, named in declared.items() if 'default_value' not in named] == ['scene'],
      'an argument other than the scene has no default:', declared)
check(all(named.get('description') for named in declared.values()), 'an argument has no description:', declared)
(opaque,) = [action for action in actions if isinstance(action, OpaqueFunction)]


def words_of(distro=None, **given):
    """The command that is started with these arguments."""
    os.environ.pop('ROS_DISTRO', None)
    if distro:
        os.environ['ROS_DISTRO'] = distro
    context = {name: given.get(name, named.get('default_value')) for name, named in declared.items()}
    (process,) = opaque.named['function'](context)
    check(isinstance(process, ExecuteProcess) and float(process.named['sigterm_timeout']) >= 5, process.named)
    return process.named['cmd']


plain = ['prescene', 'serve', '--scene', 'my table.yaml']
check(words_of(scene='my table.yaml') == plain, words_of(scene='my table.yaml'))
check(words_of('iron', scene='my table.yaml') == plain, 'a release whose form is not known is passed on')
for distro in ('humble', 'jazzy'):
    check(words_of(distro, scene='my table.yaml') == plain + ['--ros-distro', distro], distro)
check(words_of(scene='s', options="--view 0 --learned 'my file'")[-4:] == ['--view', '0', '--learned', 'my file'],
      'options are not split as in a shell')

full = words_of('jazzy', scene='no_such_scene.yaml', domain='5', record='run.mcap', camera='realsense', learned='l.yaml',
                use_sim_time='true')
options = {word for word in full if word.startswith('--')}
listed = set(re.findall(r'--[a-z][a-z-]*', subprocess.run([program, 'serve', '--help'], capture_output=True, text=True,
                                                          check=True).stdout))
check(options <= listed, 'serve has no', options - listed)
check(len(options) == 7, 'not every argument reaches the command:', full)
# The program takes the options and gets as far as the scene, which is not there.
ended = subprocess.run([program] + full[1:], capture_output=True, text=True, cwd=folder, timeout=120)
check(ended.returncode == 2 and 'no_such_scene.yaml' in ended.stderr, ended.returncode, ended.stderr)
