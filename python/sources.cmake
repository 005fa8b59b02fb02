# SPDX-License-Identifier: Apache-2.0
# What the Python package is made of, for the package and for the interpreter of its tests.
set(PRESCENE_PYTHON_SOURCES
  array_input.cc array_output.cc collision_bindings.cc interruptible.cc module.cc question_bindings.cc replay_bindings.cc
  replay_stepper.cc scene_bindings.cc status_errors.cc)
list(TRANSFORM PRESCENE_PYTHON_SOURCES PREPEND "${PROJECT_SOURCE_DIR}/python/")
set(PRESCENE_PYTHON_FILES __init__.py _prescene.pyi answers.py collision.py errors.py poses.py py.typed questions.py recordings.py)
set(PRESCENE_PYTHON_USES interfaces_bytes belief collision collision_batches core geometry queries service service_recording)
