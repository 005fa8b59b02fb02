// SPDX-License-Identifier: Apache-2.0
// A recording, tracked step by step.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "answering.h"
#include "array_output.h"
#include "interruptible.h"
#include "replay_stepper.h"
#include "status_errors.h"

namespace py = pybind11;

namespace prescene::python {
namespace {

using FramePtr = std::shared_ptr<const ReplayFrame>;

/// One object of a frame, which it keeps.
struct BoundEstimate {
  FramePtr frame;
  const service::ObjectSummary* object = nullptr;
  const service::ObjectSummary* operator->() const { return object; }
};

struct BoundFrame {
  FramePtr frame;
  std::shared_ptr<Engines> engines;
  const ReplayFrame* operator->() const { return frame.get(); }
};

/// In the child of a fork the thread to wait for is not there: what it worked on is left as it is.
struct EndReplay {
  void operator()(ReplayStepper* stepper) const {
    if (!process_lacks_threads()) delete stepper;
  }
};

struct BoundReplay {
  std::shared_ptr<Engines> engines = std::make_shared<Engines>();
  std::unique_ptr<ReplayStepper, EndReplay> stepper;
};

template <class Pixel>
py::object image_of(const std::shared_ptr<const geometry::Image<Pixel>>& image, const py::dtype& type,
                    py::ssize_t channels) {
  if (!image || image->empty()) return py::none();
  const auto size = static_cast<py::ssize_t>(sizeof(Pixel));
  std::vector<py::ssize_t> shape = {image->height(), image->width()};
  std::vector<py::ssize_t> strides = {image->width() * size, size};
  if (channels > 1) {
    shape.push_back(channels);
    strides.push_back(size / channels);
  }
  return view_of(type, shape, strides, image->data(), image);
}

py::tuple estimates_of(const BoundFrame& bound) {
  const auto& objects = bound->summary.objects;
  py::tuple tuple(objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) tuple[i] = py::cast(BoundEstimate{bound.frame, &objects[i]});
  return tuple;
}

py::dict parameters_of(const BoundEstimate& object) {
  py::dict parameters;
  for (const belief::ParameterEstimate& parameter : object->parameters)
    parameters[python_text(parameter.name)] = parameter;
  return parameters;
}

py::object object_named(const BoundFrame& bound, const std::string& name) {
  std::string names;
  for (const service::ObjectSummary& object : bound->summary.objects) {
    if (object.name == name) return py::cast(BoundEstimate{bound.frame, &object});
    names += (names.empty() ? "" : ", ") + object.name;
  }
  raise(core::not_found("there is no object '" + name + "' in this frame" +
                        (names.empty() ? "" : ": there are " + names)));
}

BoundReplay open_replay(const ReplayRequest& request) {
  check_threads(request.threads);
  BoundReplay bound;
  KeptLog log;
  core::Cancellation cancellation;
  auto stepper = interruptibly(cancellation, [&] { return ReplayStepper::open(request, log.sink()); });
  log.hand_over();
  bound.stepper.reset(value_or_raise(std::move(stepper)).release());
  return bound;
}

BoundFrame next_frame(BoundReplay& bound) {
  core::Cancellation cancellation;
  FramePtr next;
  core::Status status;
  try {
    run_interruptibly(cancellation, [&] {
      auto frame = bound.stepper->next(cancellation);
      status = frame.status();
      if (frame) next = *std::move(frame);
    });
  } catch (const py::error_already_set&) {  // a signal, just when the frame was done
    if (next) bound.stepper->give_back(std::move(next));
    throw;
  }
  raise_if_error(status);
  if (!next) throw py::stop_iteration();
  return {std::move(next), bound.engines};
}

void bind_estimates(py::module_& module) {
  py::class_<belief::ParameterEstimate>(module, "Parameter")
      .def_property_readonly("name", [](const belief::ParameterEstimate& one) { return python_text(one.name); })
      .def_readonly("mean", &belief::ParameterEstimate::mean)
      .def_readonly("standard_deviation", &belief::ParameterEstimate::standard_deviation)
      .def_readonly("low", &belief::ParameterEstimate::low)
      .def_readonly("high", &belief::ParameterEstimate::high)
      .def("__float__", [](const belief::ParameterEstimate& one) { return one.mean; })
      .def("__repr__", [](const belief::ParameterEstimate& one) {
        return python_text("<Parameter '" + one.name + "' " + std::to_string(one.mean) + " +- " +
                           std::to_string(one.standard_deviation) + ">");
      });

  py::class_<BoundEstimate>(module, "TrackedObject")
      .def_property_readonly("name", [](const BoundEstimate& object) { return python_text(object->name); })
      .def_property_readonly("model", [](const BoundEstimate& object) { return python_text(object->model); })
      .def_property_readonly("state",
                             [](const BoundEstimate& object) { return python_text(belief::to_string(object->state)); })
      .def_property_readonly("confidence", [](const BoundEstimate& object) { return object->confidence; })
      .def_property_readonly("existence", [](const BoundEstimate& object) { return object->existence; })
      .def_property_readonly("X_WO", [](const BoundEstimate& object) { return matrix_of(object->X_WO); })
      .def_property_readonly("covariance", [](const BoundEstimate& object) { return copy_of(object->covariance); })
      .def_property_readonly("twist", [](const BoundEstimate& object) { return numbers_of(object->V_WO); })
      .def_property_readonly("evidence_per_pixel",
                             [](const BoundEstimate& object) { return object->evidence_per_pixel; })
      .def_property_readonly("visible_share", [](const BoundEstimate& object) { return object->visible_share; })
      .def_property_readonly("parameters", &parameters_of)
      .def_property_readonly("lessons", [](const BoundEstimate& object) { return object->lessons; })
      .def_property_readonly("learned_ns", [](const BoundEstimate& object) { return object->learned_ns; })
      .def_property_readonly("is_new", [](const BoundEstimate& object) { return object->is_new; })
      .def("__repr__", [](const BoundEstimate& object) {
        return python_text("<TrackedObject '" + object->name + "', " + belief::to_string(object->state) + ">");
      });
}

void bind_frames(py::module_& module) {
  py::class_<BoundFrame>(module, "Frame")
      .def_property_readonly("step", [](const BoundFrame& bound) { return bound->record.step; })
      .def_property_readonly("stamp_ns", [](const BoundFrame& bound) { return bound->record.stamp_ns; })
      .def_property_readonly("time", [](const BoundFrame& bound) { return bound->seconds; })
      .def_property_readonly("belief_hash",
                             [](const BoundFrame& bound) { return python_text(bound->record.belief_hash); })
      .def_property_readonly("degraded",
                             [](const BoundFrame& bound) {
                               py::list words;
                               for (const std::string& word : bound->record.degraded) words.append(python_text(word));
                               return words;
                             })
      .def_property_readonly("skipped", [](const BoundFrame& bound) { return bound->record.skipped.size(); })
      .def_property_readonly("X_WC", [](const BoundFrame& bound) { return matrix_of(bound->X_WC); })
      .def_property_readonly("camera", [](const BoundFrame& bound) { return bound->record.camera; })
      .def_property_readonly("objects", &estimates_of)
      .def("object", &object_named, py::arg("name"))
      .def_property_readonly(
          "depth",
          [](const BoundFrame& bound) { return image_of<float>(bound->images.depth, py::dtype::of<float>(), 1); })
      .def_property_readonly("color",
                             [](const BoundFrame& bound) {
                               return image_of<geometry::Rgb>(bound->images.color, py::dtype::of<std::uint8_t>(), 3);
                             })
      .def(
          "ask_json",
          [](const BoundFrame& bound, const std::string& question, int threads, const std::string& stepper) {
            const Answering answering = [&](const belief::Query& query, const queries::QueryContext& context) {
              return queries::answer(*bound->belief, query, context);
            };
            return answer_text(*bound.engines, question, threads, stepper, answering);
          },
          py::arg("question"), py::arg("threads"), py::arg("stepper"))
      .def("__repr__", [](const BoundFrame& bound) {
        return "<Frame " + std::to_string(bound->record.step) + " at " + std::to_string(bound->seconds) + " s>";
      });
}

}  // namespace

void bind_replays(py::module_& module) {
  bind_estimates(module);
  bind_frames(module);
  py::class_<BoundReplay>(module, "Replay")
      .def(py::init([](const std::filesystem::path& recording, const std::optional<std::filesystem::path>& scene,
                       std::optional<std::uint64_t> seed, double begin, double end, bool salvage, double depth_scale,
                       double frame_rate, const std::string& learned, int threads) {
             ReplayRequest request;
             request.input.path = recording;
             if (scene) request.input.scene_file = *scene;
             request.input.metres_per_unit = depth_scale;
             request.input.frames_per_second = frame_rate;
             request.input.read.from = begin;
             request.input.read.to = end;
             request.input.read.salvage = salvage;
             request.seed = seed;
             request.learned = learned;
             request.threads = threads;
             return open_replay(request);
           }),
           py::arg("recording"), py::arg("scene"), py::arg("seed"), py::arg("begin"), py::arg("end"),
           py::arg("salvage"), py::arg("depth_scale"), py::arg("frame_rate"), py::arg("learned"), py::arg("threads"))
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &next_frame)
      .def("close",
           [](BoundReplay& bound) {
             core::Cancellation cancellation;
             run_interruptibly(cancellation, [&] { bound.stepper->close(); });
           })
      .def_property_readonly("scene",
                             [](const BoundReplay& bound) {
                               return BoundScene{bound.stepper->scene(), bound.engines};
                             })
      .def_property_readonly("seed", [](const BoundReplay& bound) { return bound.stepper->seed(); })
      .def_property_readonly("learned", [](const BoundReplay& bound) { return python_text(bound.stepper->learned()); })
      .def_property_readonly("summary_json",
                             [](const BoundReplay& bound) { return python_text(bound.stepper->summary_json()); });
}

}  // namespace prescene::python
