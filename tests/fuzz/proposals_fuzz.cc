// SPDX-License-Identifier: Apache-2.0
// Any bytes as a file of learned proposals, and as the content of one whose size and checksum are right, which a
// mutation alone would not find: read, or refused with a reason. What is read is written as the same bytes, and
// proposes sound poses.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/filter/proposals/learned_proposals.h"
#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/service/training/proposals_file.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

constexpr std::size_t kSignature = 8, kVersion = 4;

void use(const filter::LearnedProposals& proposals) {
  geometry::DepthImage depth(8, 6, 0.8F);
  depth(3, 3) = 0.5F;
  depth(0, 0) = 0.0F;
  const geometry::PinholeCamera camera{8, 6, 8.0, 8.0, 3.5, 2.5};
  const std::vector<geometry::Vector3d> places = {{0.0, 0.0, 0.8}, {0.1, -0.1, 0.5}};
  const core::RandomStream stream(1, core::Purpose::kTest);
  for (const filter::LearnedModel& model : proposals.models) {
    const auto starts = filter::learned_starts(model, depth, camera, places, {0.0, -1.0, 0.0}, 4, stream);
    PRESCENE_CHECK(starts.size() == (model.patches.empty() ? 0U : 4U));
    for (const geometry::Pose& X_CO : starts)
      PRESCENE_CHECK(X_CO.is_finite() && std::abs(X_CO.rotation.norm() - 1.0) < 1e-6);
  }
  const std::vector<float> fit(filter::kFitNumbers, 0.5F);
  PRESCENE_CHECK(!std::isnan(proposals.fit.log_odds(fit)));
}

void read(std::span<const std::uint8_t> bytes) {
  const auto proposals = service::decode_proposals(bytes);
  if (!proposals) {
    PRESCENE_CHECK(!proposals.status().message().empty());
    return;
  }
  const std::vector<std::uint8_t> again = service::encode_proposals(*proposals);
  PRESCENE_CHECK(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()));
  use(*proposals);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(data, size);
  read(bytes);
  // The content behind the header, or all of it where there is no header.
  static const std::vector<std::uint8_t> kEmpty = service::encode_proposals({});
  constexpr std::size_t kHeader = kSignature + kVersion + 8 + 4;
  const bool has_header = size >= kHeader && std::equal(kEmpty.begin(), kEmpty.begin() + kSignature, bytes.begin());
  const auto content = has_header ? bytes.subspan(kHeader) : bytes;
  std::vector<std::uint8_t> file(kEmpty.begin(), kEmpty.begin() + kSignature + kVersion);
  const std::uint64_t length = content.size();
  for (unsigned shift = 0; shift < 64; shift += 8) file.push_back(static_cast<std::uint8_t>(length >> shift));
  const std::uint32_t checksum = interfaces::crc32(content);
  for (unsigned shift = 0; shift < 32; shift += 8) file.push_back(static_cast<std::uint8_t>(checksum >> shift));
  file.insert(file.end(), content.begin(), content.end());
  read(file);
  return 0;
}
