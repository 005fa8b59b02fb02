// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/training take for granted.
#pragma once

#include <filesystem>
#include <memory>

#include "prescene/belief/scene.h"
#include "prescene/service/backends.h"
#include "prescene/service/training/proposals_file.h"

namespace prescene::service::given_service_training {

extern const std::filesystem::path path;
extern const std::shared_ptr<const belief::Scene> scene;
extern Backends backends;

namespace proposals_file_h {
extern const filter::LearnedProposals proposals;
}

}  // namespace prescene::service::given_service_training
