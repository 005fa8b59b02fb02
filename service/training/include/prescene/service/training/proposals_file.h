// SPDX-License-Identifier: Apache-2.0
// The file that keeps what training learned of a scene's models: little-endian numbers behind a signature, a version
// and a checksum (docs/reference/finding.md).
//
//   PRESCENE_RETURN_IF_ERROR(write_proposals(path, proposals));
//   PRESCENE_TRY(auto learned, load_proposals(path, *scene));   // for FilterSettings::learned
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/filter/proposals/learned_proposals.h"

namespace prescene::service {

std::vector<std::uint8_t> encode_proposals(const filter::LearnedProposals& proposals);
/// kInvalidInput for what is no such file, kUnsupported for one of a newer version, kDataLoss where it is cut or
/// damaged.
core::Result<filter::LearnedProposals> decode_proposals(std::span<const std::uint8_t> bytes);

/// The old file stays when anything fails. Errors of interfaces::write_file.
core::Status write_proposals(const std::filesystem::path& path, const filter::LearnedProposals& proposals);

/// Reads a file and checks that it was learned of the scene's models: kInvalidInput names a model that it knows nothing
/// of, or whose mesh is another one now. Errors of decode_proposals and interfaces::read_file; texts begin with the
/// path.
core::Result<std::shared_ptr<const filter::LearnedProposals>> load_proposals(const std::filesystem::path& path,
                                                                             const belief::Scene& scene);
/// The check alone.
core::Status check_proposals(const filter::LearnedProposals& proposals, const belief::Scene& scene);

}  // namespace prescene::service
