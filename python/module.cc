// SPDX-License-Identifier: Apache-2.0
// The extension module behind the Python package: what docs/reference/python.md describes is in the package's sources
// and in _prescene.pyi.
#include <pybind11/pybind11.h>

#include "bound_scene.h"

PYBIND11_MODULE(_prescene, module) {
  module.doc() = "The compiled part of the package prescene; use what prescene itself exports.";
  module.attr("__version__") = PRESCENE_VERSION;
  prescene::python::bind_scenes(module);
  prescene::python::bind_questions(module);
  prescene::python::bind_replays(module);
  prescene::python::bind_collision(module);
}
