// SPDX-License-Identifier: Apache-2.0
// The tree of named frames that /tf and /tf_static describe, over time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::service {

struct TfBufferSettings {
  double history_s = 10.0;  ///< Transforms older than the newest of their edge by more than this are dropped.
  int max_frames = 2000;    ///< More frames are refused.
  /// Transforms kept, shared evenly by the edges; an edge that has its share forgets its oldest. 200,000 take about
  /// 20 MB and give each of 40 edges 10 s at 500 Hz.
  int max_samples = 200'000;
  double max_extrapolation_s = 0.1;  ///< How far after its newest transform a moving edge may be asked.
};

/// Not thread-safe: owned by the thread that steps the belief.
class TfBuffer {
 public:
  explicit TfBuffer(TfBufferSettings settings = {}) : settings_(settings) {}

  /// Adds the pose of `child` in `parent` at a time; a static edge holds at all times. A transform older than the
  /// history is left out; three in a row mean that the newest one's stamp was wrong, or that the clock went back, and
  /// count. A leading '/' of a name is ignored. Fails with kInvalidInput, changing nothing, on an empty name, child ==
  /// parent, a cycle, another parent than before (unless all its transforms are older than the history), or a pose that
  /// is not finite; with kResourceExhausted beyond max_frames.
  core::Status add(const std::string& parent, const std::string& child, core::TimeNs stamp_ns,
                   const geometry::Pose& X_PC, bool is_static);

  /// Pose of `child` in `parent` at a time, interpolated between the transforms around it. Fails with kNotFound when
  /// a frame is unknown or the two are not connected, with kUnavailable when an edge on the way has no transform at
  /// that time (yet, or any more): the text names the edge.
  core::Result<geometry::Pose> lookup(const std::string& parent, const std::string& child, core::TimeNs stamp_ns) const;

  /// The frames on the way from `child` up to the nearest common ancestor and down to `parent`, both included; empty
  /// where they are not connected.
  std::vector<std::string> chain(const std::string& parent, const std::string& child) const;
  bool knows(const std::string& frame) const;
  /// Transforms that are kept now, and those that were forgotten before the end of the history for want of room.
  std::size_t sample_count() const { return sample_count_; }
  std::uint64_t forgotten() const { return forgotten_; }
  /// Transforms that came when they were older than the history, and were left out.
  std::uint64_t late() const { return late_; }
  /// Forgets all that is known of `child` in its parent.
  void forget(const std::string& child);
  /// Forgets moving edges: the clock jumped back.
  void forget_moving();

 private:
  struct Edge {
    std::string parent;
    bool is_static = false;
    std::deque<std::pair<core::TimeNs, geometry::Pose>> samples;  // ascending stamps; one entry if static
    int too_old_in_a_row = 0;
  };
  /// Older than the history, and not static.
  bool is_expired(const Edge& edge, core::TimeNs stamp_ns) const;
  /// Fails with kInvalidInput when an edge parent -> child would close a cycle. An expired edge on it gives way: that
  /// publisher has stopped.
  core::Status check_acyclic(const std::string& parent, const std::string& child, core::TimeNs stamp_ns);
  void erase(std::map<std::string, Edge>::iterator edge);
  void forget_beyond_limits(Edge& edge);
  core::Result<geometry::Pose> edge_pose(const std::string& child, const Edge& edge, core::TimeNs stamp_ns) const;
  /// The frame, its parent, ... up to the root of its tree.
  std::vector<std::string> path_to_root(const std::string& frame) const;
  /// Pose of the first frame of `path` in the parent of the last; identity for an empty path.
  core::Result<geometry::Pose> pose_along(std::span<const std::string> path, core::TimeNs stamp_ns) const;

  TfBufferSettings settings_;
  std::map<std::string, Edge> edges_;   // by child
  std::map<std::string, int> parents_;  // number of edges that have this frame as their parent
  std::size_t sample_count_ = 0;        // over all edges
  std::uint64_t forgotten_ = 0;
  std::uint64_t late_ = 0;
};

}  // namespace prescene::service
