#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The launch file does what ROS 2 asks of one, and starts the program with options that it has. ROS is not there: stubs
# stand in its place.
#   launch_test.sh <root of the checkout> <program>
set -eu
if ! command -v python3 > /dev/null; then
  echo "skipped: there is no python3"
  case ${PRESCENE_NO_SKIP:-0} in 0) exit 77 ;; *) exit 1 ;; esac
fi
exec python3 -B "$1/tests/house/launch_test.py" "$1/packaging/launch" "$2"
