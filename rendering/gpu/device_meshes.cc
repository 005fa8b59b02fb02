// SPDX-License-Identifier: Apache-2.0
#include "device_meshes.h"

#include <algorithm>
#include <bit>

namespace prescene::rendering {
namespace {

constexpr std::size_t kWordBytes = sizeof(std::uint32_t);
constexpr std::size_t kFirstWords = std::size_t{1} << 20;

}  // namespace

DeviceMeshes::DeviceMeshes(std::size_t most) : most_words_(most / kWordBytes) {
  buffer_.reserve(std::min(kFirstWords, most_words_) * kWordBytes);
}

std::size_t DeviceMeshes::words_of(const RenderMesh& mesh) {
  return 3 * mesh.vertices.size() + 7 * mesh.triangles.size();
}

void DeviceMeshes::begin_again() {
  places_.clear();
  words_ = 0;
  buffer_.reserve(std::min(2 * buffer_.size(), most_words_ * kWordBytes));
}

const DeviceMeshes::Place* DeviceMeshes::find(const RenderMesh& mesh) {
  const auto known = places_.find(mesh.number.value());
  if (known != places_.end()) return &known->second;
  const std::size_t words = words_of(mesh);
  if ((words_ + words) * kWordBytes > buffer_.size()) {
    if (words_ > 0 || words > most_words_) return nullptr;
    buffer_.reserve(words * kWordBytes);
  }
  upload_.clear();
  const auto real = [&](float value) { upload_.push_back(std::bit_cast<std::uint32_t>(value)); };
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    for (const Vector3f& p : mesh.vertices) real(p[axis]);
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (const auto& triangle : mesh.triangles) upload_.push_back(triangle[corner]);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    for (const Vector3f& n : mesh.normals) real(n[axis]);
  for (const float offset : mesh.offsets) real(offset);
  buffer_.write(words_ * kWordBytes, upload_.data(), words * kWordBytes);
  Place place;
  place.vertices_at = static_cast<std::uint32_t>(words_);
  place.faces_at = static_cast<std::uint32_t>(words_ + 3 * mesh.vertices.size());
  words_ += words;
  return &places_.emplace(mesh.number.value(), place).first->second;
}

}  // namespace prescene::rendering
