// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/mesh_facts.h"

#include <algorithm>
#include <map>
#include <mutex>

#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

/// By the meshes' owners, so that another mesh at the address of one that is gone is another one: a weak pointer keeps
/// its owner's number of references, though not the mesh.
class FactsTable {
 public:
  MeshFacts get(const std::shared_ptr<const TriangleMesh>& mesh) {
    const Key key(mesh);
    const bool is_owned = mesh.use_count() > 0;  // of what nobody owns it is not known when it is gone
    if (is_owned) {
      const std::lock_guard lock(mutex_);
      if (const auto found = by_owner_.find(key); found != by_owner_.end() && found->second.mesh == mesh.get())
        return found->second.facts;
    }
    MeshFacts facts;
    facts.content = content_hash(*mesh);
    facts.box = bounding_box(*mesh);
    if (!facts.box.isEmpty()) facts.radius = radius_about(*mesh, facts.box.center());
    facts.reach = radius_about(*mesh, Vector3d::Zero());
    if (!is_owned) return facts;
    const std::lock_guard lock(mutex_);
    if (by_owner_.size() >= forget_at_) {
      std::erase_if(by_owner_, [](const auto& entry) { return entry.first.expired(); });
      forget_at_ = std::max(kForgetAt, 2 * by_owner_.size());
    }
    by_owner_.insert_or_assign(key, Entry{mesh.get(), facts});
    ++made_;
    return facts;
  }

  std::size_t made() {
    const std::lock_guard lock(mutex_);
    return made_;
  }

 private:
  using Key = std::weak_ptr<const TriangleMesh>;
  struct Entry {
    const TriangleMesh* mesh;  // of one owner there may be several
    MeshFacts facts;
  };
  static constexpr std::size_t kForgetAt = 64;

  std::mutex mutex_;
  std::map<Key, Entry, std::owner_less<Key>> by_owner_;
  std::size_t forget_at_ = kForgetAt;
  std::size_t made_ = 0;
};

FactsTable& facts_table() {
  // Never destroyed: threads of other languages may still ask when the process ends.
  static FactsTable& table = *new FactsTable;
  return table;
}

}  // namespace

MeshFacts facts_of(const std::shared_ptr<const TriangleMesh>& mesh) {
  PRESCENE_CHECK(mesh != nullptr);
  return facts_table().get(mesh);
}

std::size_t mesh_facts_made() { return facts_table().made(); }

}  // namespace prescene::geometry
