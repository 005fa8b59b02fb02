// SPDX-License-Identifier: Apache-2.0
// Debian's Python with the extension module built in, for tests: a program takes in the libraries of every build, which
// a module that Python loads does not (cmake/PresceneCompiler.cmake).
#include <pybind11/pybind11.h>

extern "C" PyObject* PyInit__prescene();

int main(int argc, char** argv) {
  PyImport_AppendInittab("_prescene", PyInit__prescene);
  return Py_BytesMain(argc, argv);
}
