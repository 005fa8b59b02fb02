// SPDX-License-Identifier: Apache-2.0
// Questions about scenes, in the JSON of docs/reference/queries.md.
#include <pybind11/stl.h>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "answering.h"
#include "interruptible.h"
#include "prescene/belief/json.h"
#include "status_errors.h"

namespace py = pybind11;

namespace prescene::python {

py::str answer_text(Engines& engines, const std::string& question, int threads, const std::string& stepper,
                    const Answering& answering) {
  check_threads(threads);
  const service::Stepper kind = stepper_named(stepper);
  const belief::Query query = value_or_raise(belief::query_from_json(question));
  core::Cancellation cancellation;
  core::Status error;
  std::string text;
  run_interruptibly(cancellation, [&] {
    const std::shared_ptr<Engine> engine = engines.get(threads, kind);
    queries::QueryContext context = engine->backends.query_context(engine->pool);
    context.cancellation = context.abandoned = &cancellation;
    const belief::Answer answer = answering(query, context);
    error = answer.error;
    if (error.ok()) text = belief::json_text(belief::to_json(answer));
  });
  raise_if_error(error);
  return python_text(text);
}

void bind_questions(py::module_& module) {
  module.def(
      "ask_scene",
      [](const BoundScene& bound, const std::string& question, std::uint64_t seed, int threads,
         const std::string& stepper) {
        const Answering answering = [&](const belief::Query& query, const queries::QueryContext& context) {
          return queries::answer(bound.scene, seed, query, context);
        };
        return answer_text(*bound.engines, question, threads, stepper, answering);
      },
      py::arg("scene"), py::arg("question"), py::arg("seed"), py::arg("threads"), py::arg("stepper"));
}

}  // namespace prescene::python
