// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/tf_buffer.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "prescene/core/text.h"

namespace prescene::service {
namespace {

// Of each edge, however many there are: 3 s at 30 Hz.
constexpr std::size_t kLeastSamplesOfAnEdge = 100;
// So many transforms from before the history can't all be late.
constexpr int kTooOldToBeWrong = 3;

std::string without_slash(const std::string& name) {
  return !name.empty() && name.front() == '/' ? name.substr(1) : name;
}

}  // namespace

bool TfBuffer::knows(const std::string& frame) const {
  const std::string name = without_slash(frame);
  return edges_.contains(name) || parents_.contains(name);
}

core::Status TfBuffer::add(const std::string& raw_parent, const std::string& raw_child, core::TimeNs stamp_ns,
                           const geometry::Pose& X_PC, bool is_static) {
  const std::string parent = without_slash(raw_parent);
  const std::string child = without_slash(raw_child);
  if (parent.empty() || child.empty())
    return core::invalid_input("a transform with an empty frame name: name both frames");
  if (parent == child) return core::invalid_input("frame '" + child + "' is its own parent: correct the publisher");
  if (!X_PC.is_finite()) {
    return core::invalid_input("transform " + parent + " -> " + child + " is not finite: correct the publisher");
  }
  auto found = edges_.find(child);
  const bool is_known = found != edges_.end() && found->second.parent == parent;
  if (!is_known) PRESCENE_RETURN_IF_ERROR(check_acyclic(parent, child, stamp_ns));
  if (found != edges_.end() && !is_known) {
    if (!is_expired(found->second, stamp_ns)) {
      return core::invalid_input("frame '" + child + "' has the parent '" + found->second.parent + "' and now also '" +
                                 parent + "': stop one of the two publishers");
    }
    erase(found);
    found = edges_.end();
  }
  if (found == edges_.end()) {
    if (static_cast<int>(edges_.size()) >= settings_.max_frames) {
      return core::resource_exhausted("more than " + std::to_string(settings_.max_frames) +
                                      " frames: raise tf.max_frames if that is meant");
    }
    found = edges_.emplace(child, Edge{parent, is_static, {}}).first;
    ++parents_[parent];
  }
  Edge& edge = found->second;
  edge.is_static = edge.is_static || is_static;
  if (edge.is_static) {
    sample_count_ += 1 - edge.samples.size();
    edge.samples.assign(1, {stamp_ns, X_PC});
    return core::ok_status();
  }
  if (!edge.samples.empty() && stamp_ns + core::ns_of(settings_.history_s) < edge.samples.back().first) {
    if (++edge.too_old_in_a_row < kTooOldToBeWrong) {
      ++late_;
      return core::ok_status();
    }
    sample_count_ -= edge.samples.size();
    edge.samples.clear();
  }
  edge.too_old_in_a_row = 0;
  const auto place = std::lower_bound(edge.samples.begin(), edge.samples.end(), stamp_ns,
                                      [](const auto& sample, core::TimeNs t) { return sample.first < t; });
  if (place != edge.samples.end() && place->first == stamp_ns) {
    place->second = X_PC;
  } else {
    edge.samples.insert(place, {stamp_ns, X_PC});
    ++sample_count_;
  }
  forget_beyond_limits(edge);
  return core::ok_status();
}

bool TfBuffer::is_expired(const Edge& edge, core::TimeNs stamp_ns) const {
  return !edge.is_static && edge.samples.back().first + core::ns_of(settings_.history_s) < stamp_ns;
}

core::Status TfBuffer::check_acyclic(const std::string& parent, const std::string& child, core::TimeNs stamp_ns) {
  auto expired = edges_.end();
  for (auto edge = edges_.find(parent); edge != edges_.end(); edge = edges_.find(edge->second.parent)) {
    if (expired == edges_.end() && is_expired(edge->second, stamp_ns)) expired = edge;
    if (edge->second.parent != child) continue;
    if (expired == edges_.end()) {
      return core::invalid_input("transform " + parent + " -> " + child +
                                 " would close a cycle: stop the publisher of one of its transforms");
    }
    erase(expired);
    break;
  }
  return core::ok_status();
}

void TfBuffer::forget_beyond_limits(Edge& edge) {
  auto& samples = edge.samples;
  const auto forget_oldest = [&] {
    samples.pop_front();
    --sample_count_;
  };
  while (samples.front().first + core::ns_of(settings_.history_s) < samples.back().first) forget_oldest();
  const std::size_t share =
      std::max(kLeastSamplesOfAnEdge, static_cast<std::size_t>(settings_.max_samples) / edges_.size());
  while (samples.size() > share) {
    forget_oldest();
    ++forgotten_;
  }
}

void TfBuffer::forget(const std::string& child) {
  const auto edge = edges_.find(without_slash(child));
  if (edge != edges_.end()) erase(edge);
}

void TfBuffer::erase(std::map<std::string, Edge>::iterator edge) {
  sample_count_ -= edge->second.samples.size();
  if (--parents_[edge->second.parent] == 0) parents_.erase(edge->second.parent);
  edges_.erase(edge);
}

void TfBuffer::forget_moving() {
  for (auto edge = edges_.begin(); edge != edges_.end();) {
    const auto next = std::next(edge);
    if (!edge->second.is_static) erase(edge);
    edge = next;
  }
}

core::Result<geometry::Pose> TfBuffer::edge_pose(const std::string& child, const Edge& edge,
                                                 core::TimeNs stamp_ns) const {
  if (edge.is_static) return edge.samples.front().second;
  const auto& samples = edge.samples;
  if (stamp_ns < samples.front().first) {
    return core::unavailable("transform " + edge.parent + " -> " + child + " begins " +
                             core::rounded_text(core::seconds_of(samples.front().first - stamp_ns)) +
                             " s after the asked time");
  }
  if (stamp_ns > samples.back().first) {
    if (stamp_ns - samples.back().first > core::ns_of(settings_.max_extrapolation_s)) {
      return core::unavailable("transform " + edge.parent + " -> " + child + " is " +
                               core::rounded_text(core::seconds_of(stamp_ns - samples.back().first)) +
                               " s older than the asked time");
    }
    return samples.back().second;
  }
  const auto after = std::lower_bound(samples.begin(), samples.end(), stamp_ns,
                                      [](const auto& sample, core::TimeNs t) { return sample.first < t; });
  if (after->first == stamp_ns) return after->second;
  const auto before = std::prev(after);
  const double t = static_cast<double>(stamp_ns - before->first) / static_cast<double>(after->first - before->first);
  return geometry::interpolate(before->second, after->second, t);
}

std::vector<std::string> TfBuffer::path_to_root(const std::string& frame) const {
  std::vector<std::string> path{frame};
  for (auto edge = edges_.find(frame); edge != edges_.end(); edge = edges_.find(path.back())) {
    path.push_back(edge->second.parent);
  }
  return path;
}

core::Result<geometry::Pose> TfBuffer::pose_along(std::span<const std::string> path, core::TimeNs stamp_ns) const {
  geometry::Pose X_AF;
  for (const std::string& frame : path) {
    PRESCENE_TRY(const geometry::Pose X_PC, edge_pose(frame, edges_.at(frame), stamp_ns));
    X_AF = X_PC * X_AF;
  }
  return X_AF;
}

std::vector<std::string> TfBuffer::chain(const std::string& raw_parent, const std::string& raw_child) const {
  std::vector<std::string> from_child = path_to_root(without_slash(raw_child));
  std::vector<std::string> from_parent = path_to_root(without_slash(raw_parent));
  if (from_child.back() != from_parent.back()) return {};
  std::string common;
  while (!from_parent.empty() && !from_child.empty() && from_parent.back() == from_child.back()) {
    common = from_child.back();
    from_parent.pop_back();
    from_child.pop_back();
  }
  from_child.push_back(common);
  from_child.insert(from_child.end(), from_parent.rbegin(), from_parent.rend());
  return from_child;
}

core::Result<geometry::Pose> TfBuffer::lookup(const std::string& raw_parent, const std::string& raw_child,
                                              core::TimeNs stamp_ns) const {
  const std::string parent = without_slash(raw_parent);
  const std::string child = without_slash(raw_child);
  if (parent == child) return geometry::Pose::identity();
  for (const std::string& frame : {child, parent}) {
    if (!knows(frame))
      return core::not_found("no transform names the frame '" + frame + "': is its publisher running?");
  }
  std::vector<std::string> from_parent = path_to_root(parent);
  std::vector<std::string> from_child = path_to_root(child);
  if (from_parent.back() != from_child.back()) {
    return core::not_found("the frames '" + parent + "' and '" + child + "' are in two trees (roots '" +
                           from_parent.back() + "' and '" + from_child.back() +
                           "'): publish the transform between them");
  }
  // What is above the nearest common ancestor cancels out and need not be known at this time.
  while (!from_parent.empty() && !from_child.empty() && from_parent.back() == from_child.back()) {
    from_parent.pop_back();
    from_child.pop_back();
  }
  PRESCENE_TRY(const geometry::Pose X_AC, pose_along(from_child, stamp_ns));
  PRESCENE_TRY(const geometry::Pose X_AP, pose_along(from_parent, stamp_ns));
  return geometry::normalized(X_AP.inverse() * X_AC);
}

}  // namespace prescene::service
