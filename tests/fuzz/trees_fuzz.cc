// SPDX-License-Identifier: Apache-2.0
// Bytes as the file of a tree: refused with a reason, or a tree on which every query ends and does no harm.
//
//   number of the kind of tree (a byte), the file: its header is made that of a sound one, its checksum is made right.
#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "prescene/collision/batch_queries.h"
#include "prescene/collision/continuous_queries.h"
#include "prescene/collision/distance_queries.h"
#include "prescene/collision/penetration.h"
#include "prescene/collision/ray_queries.h"
#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_file_seal.h"
#include "prescene/collision/triangle_queries.h"
#include "tree_kinds.h"

using namespace prescene;             // NOLINT(google-build-using-namespace)
using namespace prescene::collision;  // NOLINT(google-build-using-namespace)

namespace {

constexpr std::size_t kHeader = 64;

Transform moved(float x) {
  Transform X;
  X.translation = {x, 0.01F, 0.3F * x};
  return X;
}

void query(const DopTree& a, const DopTree& b, const Transform& X_AB) { static_cast<void>(collide(a, b, X_AB)); }
void query(const Boxtree& a, const Boxtree& b, const Transform& X_AB) { static_cast<void>(collide(a, b, X_AB)); }
void query(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB) {
  QueryScratch scratch;
  static_cast<void>(collide(a, b, X_AB, scratch));
}
void query(const BvhLiteTree& a, const BvhLiteTree& b, const Transform& X_AB) {
  BvhLiteScratch scratch;
  static_cast<void>(collide(a, b, X_AB, scratch));
}
void query(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB) {
  static PenetrationScratch penetration_scratch;
  QueryScratch& scratch = penetration_scratch.queries();
  std::vector<TrianglePair> pairs;
  static_cast<void>(collide(a, b, X_AB, scratch));
  const std::array<Transform, 2> batch = {X_AB, moved(0.5F)};
  std::array<bool, 2> answers{};
  collide(a, b, batch, answers, scratch);
  all_pairs(a, b, X_AB, 1000, &pairs, scratch);
  static_cast<void>(distance(a, b, X_AB, {}, scratch));
  static_cast<void>(within_distance(a, b, X_AB, 0.01, scratch));
  static_cast<void>(nearest_hit(a, {.origin = {0.05, 0.03, -1.0}, .direction = {0.0, 0.01, 1.0}}, scratch));
  geometry::Pose start;
  geometry::Pose end;
  start.translation = {-1.0, 0.0, 0.1};
  end.translation = {1.0, static_cast<double>(X_AB.translation[1]), 0.1};
  const auto motion = ScrewMotion::make(start, end);
  PRESCENE_CHECK(motion.ok());
  static_cast<void>(first_contact(a, b, *motion, {.step_limit = 10'000}, scratch));
  static_cast<void>(penetration(a, b, X_AB, {}, penetration_scratch));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size <= kHeader) return 0;
  tests::visit_tree_kind(data[0], [&]<class Tree>(const auto& options) {
    static const std::shared_ptr<const Mesh> kMesh = tests::tree_kinds_mesh();
    core::ThreadPool one(1);
    const Tree sound = Tree::build(kMesh, options, one);
    std::vector<std::uint8_t> bytes(data + 1, data + size);
    bytes.resize((bytes.size() + kTreeFileAlignment - 1) / kTreeFileAlignment * kTreeFileAlignment);
    const std::vector<std::uint8_t> good = tests::file_bytes(sound);
    std::copy_n(good.begin(), kHeader, bytes.begin());
    constexpr std::size_t kFileSizeAt = 48;
    const std::uint64_t file_size = bytes.size();
    std::memcpy(bytes.data() + kFileSizeAt, &file_size, sizeof file_size);
    seal_tree_file(bytes);
    const auto loaded = Tree::from_bytes(bytes, kMesh, options);
    if (!loaded) {
      PRESCENE_CHECK(loaded.status().message().starts_with("tree: "));
      return;
    }
    for (const float x : {0.0F, 0.03F, 0.2F}) {
      query(*loaded, sound, moved(x));
      query(sound, *loaded, moved(x));
    }
  });
  return 0;
}
