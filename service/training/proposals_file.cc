// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/training/proposals_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "prescene/filter/proposals/render_scene.h"
#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::service {
namespace {

using filter::BoostedTrees;

constexpr std::array<std::uint8_t, 8> kSignature = {'P', 'S', 'C', 'N', 'P', 'R', 'O', 'P'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeader = kSignature.size() + 4 + 8 + 4;  // version, bytes that follow, their checksum
constexpr std::size_t kMostBytes = std::size_t{1} << 30;
constexpr std::size_t kMostModels = 100'000;
constexpr std::size_t kMostTrees = 100'000;
const std::string kRemedy = ": make it anew with `prescene train SCENE -o FILE`";

class Writer {
 public:
  template <class T>
  void number(T value) {
    static_assert(std::endian::native == std::endian::little);
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);  // NOLINT: bytes of a number
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  }
  void raw(std::span<const std::uint8_t> more) { bytes.insert(bytes.end(), more.begin(), more.end()); }
  template <class Range>
  void numbers(const Range& range) {
    for (const auto value : range) number(value);
  }

  std::vector<std::uint8_t> bytes;
};

template <class Range>
void read_into(interfaces::ByteReader& reader, Range& range) {
  for (auto& value : range) value = reader.read<std::decay_t<decltype(value)>>();
}

/// A number of things of at least `size` bytes each that fit into what is left.
std::size_t read_count(interfaces::ByteReader& reader, std::size_t size, std::size_t most) {
  const auto count = static_cast<std::size_t>(reader.read<std::uint32_t>());
  if (count <= most && count <= reader.remaining() / size) return count;
  reader.take(reader.remaining() + 1);  // no longer ok
  return 0;
}

bool finite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

filter::LearnedModel read_model(interfaces::ByteReader& reader, bool& sane) {
  filter::LearnedModel model;
  const auto name = reader.take(read_count(reader, 1, 4096));
  model.name.assign(name.begin(), name.end());
  model.mesh = reader.read<std::uint64_t>();
  model.spacing = reader.read<float>();
  sane = sane && std::isfinite(model.spacing) && model.spacing > 0.0F;
  model.rests.resize(read_count(reader, 16, kMostBytes));
  for (filter::LearnedRest& rest : model.rests) {
    read_into(reader, rest.up_O);
    rest.probability = reader.read<float>();
    sane = sane && finite(rest.up_O) && rest.probability >= 0.0F && rest.probability <= 1.0F;
  }
  const std::size_t patches = read_count(reader, filter::SurfacePatch::kCells + 1 + 28, kMostBytes);
  model.patches.resize(patches);
  model.X_AO.resize(patches);
  for (filter::SurfacePatch& patch : model.patches) {
    read_into(reader, patch.relief);
    patch.elevation = reader.read<std::uint8_t>();
  }
  for (filter::StoredPose& pose : model.X_AO) {
    read_into(reader, pose.rotation);
    read_into(reader, pose.translation);
    double norm = 0.0;
    for (const float q : pose.rotation) norm += static_cast<double>(q) * static_cast<double>(q);
    sane = sane && finite(pose.translation) && std::abs(norm - 1.0) < 1e-3;
  }
  return model;
}

BoostedTrees read_trees(interfaces::ByteReader& reader, bool& sane) {
  BoostedTrees trees;
  trees.bias = reader.read<double>();
  sane = sane && std::isfinite(trees.bias);
  trees.trees.resize(read_count(reader, BoostedTrees::kSplits * 6 + BoostedTrees::kLeaves * 4, kMostTrees));
  for (BoostedTrees::Tree& tree : trees.trees) {
    read_into(reader, tree.column);
    read_into(reader, tree.threshold);
    read_into(reader, tree.leaf);
    sane = sane && finite(tree.leaf) &&
           std::all_of(tree.column.begin(), tree.column.end(), [](auto c) { return c < filter::kFitNumbers; }) &&
           std::none_of(tree.threshold.begin(), tree.threshold.end(), [](float t) { return std::isnan(t); });
  }
  return trees;
}

}  // namespace

std::vector<std::uint8_t> encode_proposals(const filter::LearnedProposals& proposals) {
  Writer content;
  content.number(static_cast<std::uint32_t>(filter::kFitNumbers));
  content.number(static_cast<std::uint32_t>(proposals.models.size()));
  for (const filter::LearnedModel& model : proposals.models) {
    content.number(static_cast<std::uint32_t>(model.name.size()));
    for (const char c : model.name) content.number(static_cast<std::uint8_t>(c));
    content.number(model.mesh);
    content.number(model.spacing);
    content.number(static_cast<std::uint32_t>(model.rests.size()));
    for (const filter::LearnedRest& rest : model.rests) {
      content.numbers(rest.up_O);
      content.number(rest.probability);
    }
    content.number(static_cast<std::uint32_t>(model.patches.size()));
    for (const filter::SurfacePatch& patch : model.patches) {
      content.raw(patch.relief);
      content.number(patch.elevation);
    }
    for (const filter::StoredPose& pose : model.X_AO) {
      content.numbers(pose.rotation);
      content.numbers(pose.translation);
    }
  }
  content.number(proposals.fit.bias);
  content.number(static_cast<std::uint32_t>(proposals.fit.trees.size()));
  for (const BoostedTrees::Tree& tree : proposals.fit.trees) {
    content.numbers(tree.column);
    content.numbers(tree.threshold);
    content.numbers(tree.leaf);
  }
  content.numbers(proposals.confidence);
  Writer file;
  file.raw(kSignature);
  file.number(kVersion);
  file.number(static_cast<std::uint64_t>(content.bytes.size()));
  file.number(interfaces::crc32(content.bytes));
  file.raw(content.bytes);
  return std::move(file.bytes);
}

core::Result<filter::LearnedProposals> decode_proposals(std::span<const std::uint8_t> bytes) {
  interfaces::ByteReader reader(bytes);
  const auto signature = reader.take(std::min(bytes.size(), kSignature.size()));
  if (signature.size() < kSignature.size() || !std::equal(signature.begin(), signature.end(), kSignature.begin()))
    return core::invalid_input("not a file of learned proposals (bad signature)" + kRemedy);
  const auto version = reader.read<std::uint32_t>();
  const auto size = reader.read<std::uint64_t>();
  const auto checksum = reader.read<std::uint32_t>();
  if (reader.ok() && version != kVersion)
    return core::unsupported("is of version " + std::to_string(version) + " of the format, and this program reads " +
                             std::to_string(kVersion) + kRemedy + ", or use the program that made it");
  if (!reader.ok() || size != reader.remaining())
    return core::data_loss(bytes.size() < kHeader || size > reader.remaining()
                               ? "is cut off after " + interfaces::size_text(bytes.size()) + kRemedy
                               : "goes on after its end" + kRemedy);
  if (interfaces::crc32(bytes.subspan(kHeader)) != checksum)
    return core::data_loss("is damaged: its checksum is another one" + kRemedy);
  filter::LearnedProposals proposals;
  bool sane = reader.read<std::uint32_t>() == static_cast<std::uint32_t>(filter::kFitNumbers);
  const std::size_t models = read_count(reader, 24, kMostModels);
  for (std::size_t i = 0; i < models && reader.ok(); ++i) proposals.models.push_back(read_model(reader, sane));
  proposals.fit = read_trees(reader, sane);
  read_into(reader, proposals.confidence);
  for (const double c : proposals.confidence) sane = sane && std::isfinite(c);
  if (!reader.ok() || reader.remaining() != 0 || !sane)
    return core::data_loss("holds numbers that no training writes" + kRemedy);
  return proposals;
}

core::Status write_proposals(const std::filesystem::path& path, const filter::LearnedProposals& proposals) {
  return interfaces::write_file(path, std::span<const std::uint8_t>(encode_proposals(proposals)));
}

core::Status check_proposals(const filter::LearnedProposals& proposals, const belief::Scene& scene) {
  filter::MeshCache meshes;
  for (const belief::ObjectModel& model : scene.models) {
    const auto mesh = meshes.get(model.visual, model.collision, filter::MeshDetail::kLikelihood);
    if (filter::find(proposals, *mesh) != nullptr) continue;
    const bool named = std::any_of(proposals.models.begin(), proposals.models.end(),
                                   [&](const auto& learned) { return learned.name == model.name; });
    return core::invalid_input((named ? "was learned of another mesh of model " : "knows nothing of model ") +
                               interfaces::quote(model.name) + ": make it anew with `prescene train` on this scene");
  }
  return core::ok_status();
}

core::Result<std::shared_ptr<const filter::LearnedProposals>> load_proposals(const std::filesystem::path& path,
                                                                             const belief::Scene& scene) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(path, kMostBytes));
  auto proposals = decode_proposals(bytes);
  if (!proposals) return proposals.status().at(path.string());
  PRESCENE_RETURN_IF_ERROR(check_proposals(*proposals, scene).at(path.string()));
  return std::shared_ptr<const filter::LearnedProposals>(
      std::make_shared<filter::LearnedProposals>(*std::move(proposals)));
}

}  // namespace prescene::service
