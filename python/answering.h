// SPDX-License-Identifier: Apache-2.0
// How a question in JSON is answered, whatever it is about.
#pragma once

#include <pybind11/pybind11.h>
#include <functional>
#include <string>

#include "bound_scene.h"
#include "prescene/queries/query_engine.h"

namespace prescene::python {

using Answering = std::function<belief::Answer(const belief::Query& query, const queries::QueryContext& context)>;

/// The answer as JSON, without the GIL and ended by Ctrl-C. What can't be asked or answered is raised.
pybind11::str answer_text(Engines& engines, const std::string& question, int threads, const std::string& stepper,
                          const Answering& answering);

}  // namespace prescene::python
