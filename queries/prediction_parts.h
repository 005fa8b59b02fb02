// SPDX-License-Identifier: Apache-2.0
// The parts of a prediction that come with the probabilities, each from a finished foresight.
#pragma once

#include <optional>
#include <vector>

#include "prescene/belief/prediction.h"
#include "tasks.h"

namespace prescene::queries {

/// What of the start and the actions was drawn: its name and its value in each instance. What does not vary is left
/// out.
struct UncertainInput {
  std::string name;
  std::vector<double> values;
};
std::vector<UncertainInput> uncertain_inputs(const Foresight& foresight, const Prior& prior,
                                             const QueryContext& context);

/// Of each variable whose classes vary; empty with fewer than 128 instances, from the first 65536 where there are more.
/// Those worked out so far when abandoned.
std::vector<belief::DecidingInputs> deciding_inputs(const Foresight& foresight, const Prior& prior,
                                                    const QueryContext& context);

/// Into `contact_times` and `contacts`, from instances that ran to rest with their contacts kept. False, and nothing,
/// when abandoned.
bool forecast_contacts(const Foresight& foresight, double confidence, const core::Cancellation* abandoned,
                       belief::PredictAnswer& answer);

/// For how long nothing can touch anything, into `flight`. Nothing is told when stopped, without a shape store, or
/// where a shape can't be made of spheres. Fails when the objects can't be simulated each by itself.
core::Status forecast_flight(const Foresight& foresight, const Prior& prior, const QueryContext& context,
                             belief::PredictAnswer& answer);

/// Runs some instances again from starts near by. Empty when stopped, or with fewer than 32 instances.
std::vector<belief::ChaosCheck> check_for_chaos(const Foresight& foresight, const Prior& prior, double confidence,
                                                const QueryContext& context);

/// Runs the first instances again at half and double step, and with each uncertain physical parameter of an object or
/// support at the ends of its prior. Nothing when stopped.
core::Result<std::optional<belief::ModelError>> model_error(const Foresight& foresight, const Prior& prior,
                                                            double confidence, const QueryContext& context);

/// Up to `count` instances' ways of the objects (by index). Not `complete` when stopped, or where the points of all of
/// them would not fit into an answer.
std::vector<belief::ObjectPath> paths_of(const Foresight& foresight, const Prior& prior, int count,
                                         const std::vector<std::size_t>& objects, const QueryContext& context,
                                         bool& complete);

/// The variable whose classes an object's ends are told apart by: the first exclusive group about it, else the first
/// outcome about it.
std::optional<std::size_t> variable_about(const belief::Scene& scene, const std::string& object);
/// The group's name, or the outcome's.
const std::string& name_of(const simulation::Variable& variable);
/// Classes that are told: of a single outcome its opposite is not, which is the same number again.
std::size_t told_classes(const simulation::Variable& variable);

/// Sentences about what was found.
std::vector<std::string> remarks_of(const belief::PredictAnswer& answer, const belief::Effort& effort);

}  // namespace prescene::queries
