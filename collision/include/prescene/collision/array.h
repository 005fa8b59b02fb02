// SPDX-License-Identifier: Apache-2.0
// A read-only array that owns its values or looks at a part of something that somebody else keeps alive, such as a
// mapped file. Copies share the values.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace prescene::collision {

template <class T>
class Array {
 public:
  Array() = default;
  /// Takes the values.
  explicit Array(std::vector<T> values) {
    auto kept = std::make_shared<const std::vector<T>>(std::move(values));
    view_ = *kept;
    owner_ = std::move(kept);
  }
  /// Looks at `view`, which lives as long as `owner` (not checked).
  Array(std::span<const T> view, std::shared_ptr<const void> owner) : view_(view), owner_(std::move(owner)) {}

  std::span<const T> span() const { return view_; }
  const T* data() const { return view_.data(); }
  std::size_t size() const { return view_.size(); }
  std::size_t bytes() const { return view_.size_bytes(); }
  bool empty() const { return view_.empty(); }
  /// `i` < size(); not checked.
  const T& operator[](std::size_t i) const { return view_[i]; }
  auto begin() const { return view_.begin(); }
  auto end() const { return view_.end(); }

 private:
  std::span<const T> view_;
  std::shared_ptr<const void> owner_;
};

}  // namespace prescene::collision
