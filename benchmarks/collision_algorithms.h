// SPDX-License-Identifier: Apache-2.0
// Everything that the collision benchmark compares, behind one form: our trees and the libraries of tests/peers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/hierarchy.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/transform.h"
#include "prescene/core/parallel.h"

namespace prescene::benchmarks {

using CollisionMesh = std::shared_ptr<const collision::Mesh>;

/// Of one mesh.
struct BuildCost {
  double seconds = 0.0;
  std::optional<double> bytes;  ///< Nodes and references to triangles; nothing where a library does not tell.
};

/// Work of one query.
struct WorkCounts {
  double volume_tests = 0.0;
  double triangle_tests = 0.0;
};

/// A pair of meshes as one algorithm keeps it. What an algorithm does not have aborts when called.
class PairSolver {
 public:
  virtual ~PairSolver() = default;
  PairSolver(const PairSolver&) = delete;
  PairSolver& operator=(const PairSolver&) = delete;

  virtual bool collide(const collision::Transform& X_AB) = 0;
  virtual double distance(const collision::Transform& X_AB);  ///< m, zero or less when they touch.
  virtual void collide_batch(std::span<const collision::Transform> X_AB, std::span<bool> answers);
  virtual WorkCounts count(const collision::Transform& X_AB);
  /// What it answers otherwise than we ask; empty if nothing.
  virtual std::string_view differs() const { return ""; }

  BuildCost cost_a;
  BuildCost cost_b;

 protected:
  PairSolver() = default;
};

struct Algorithm {
  std::string name;
  bool ours = false;  ///< Promises the exact answer for the triangles in single precision.
  bool has_distance = false;
  bool has_batches = false;
  bool has_counts = false;
  bool slow = false;  ///< Milliseconds a query: measured on fewer configurations.
  std::function<std::unique_ptr<PairSolver>(const CollisionMesh& a, const CollisionMesh& b)> make;
};

// Names that targets refer to.
inline constexpr std::string_view kFcl = "FCL OBBRSS";
inline constexpr std::string_view kDefaultTree = "default tree";
inline constexpr std::string_view kBoxtree = "Boxtree";
inline constexpr std::string_view kPlainBoxtree = "plain Boxtree";
inline constexpr std::string_view kScalarDops = "scalar binary k-DOP tree";
inline constexpr std::string_view kGimpact = "Bullet GImpact, first contact";
inline constexpr std::string_view kOde = "ODE trimesh";
inline constexpr std::string_view kEmbree = "Embree rtcCollide";

/// Other people's libraries.
std::vector<Algorithm> peer_algorithms();
/// The trees of our library, each with its default settings.
std::vector<Algorithm> our_algorithms();
/// The same with other settings, one changed at a time; begins with the default tree.
std::vector<Algorithm> study_algorithms();
std::string bvhlite_name(const collision::BvhLiteOptions& options);
std::string simdop_name(const collision::SimdopOptions& options);
/// Of the default tree with that builder.
std::string default_tree_name(collision::Builder builder);

}  // namespace prescene::benchmarks
