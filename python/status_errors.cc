// SPDX-License-Identifier: Apache-2.0
#include "status_errors.h"

namespace py = pybind11;

namespace prescene::python {

py::str python_text(std::string_view text) {
  PyObject* made = PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace");
  if (made == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(made);
}

void raise(const core::Status& status, const interfaces::FileReport& report) {
  py::list problems;
  for (const interfaces::Problem& problem : report.errors) {
    problems.append(py::make_tuple(python_text(problem.file), problem.line, problem.column, python_text(problem.key),
                                   python_text(problem.reason), python_text(problem.remedy)));
  }
  const py::object error =
      py::module_::import("prescene.errors")
          .attr("error_of")(python_text(core::to_string(status.code())), python_text(status.message()), problems);
  PyErr_SetObject(py::type::of(error).ptr(), error.ptr());
  throw py::error_already_set();
}

void raise_input(const std::string& message) { raise(core::invalid_input(message)); }

core::LogSink KeptLog::sink() {
  return [this](core::LogLevel level, const std::string& text) {
    const std::lock_guard lock(mutex_);
    lines_.emplace_back(level, text);
  };
}

void KeptLog::hand_over() {
  std::vector<std::pair<core::LogLevel, std::string>> lines;
  {
    const std::lock_guard lock(mutex_);
    lines.swap(lines_);
  }
  if (lines.empty()) return;
  const py::object logger = py::module_::import("logging").attr("getLogger")("prescene");
  for (const auto& [level, text] : lines) {
    const char* method = level == core::LogLevel::kDebug     ? "debug"
                         : level == core::LogLevel::kInfo    ? "info"
                         : level == core::LogLevel::kWarning ? "warning"
                                                             : "error";
    logger.attr(method)("%s", python_text(text));
  }
}

}  // namespace prescene::python
