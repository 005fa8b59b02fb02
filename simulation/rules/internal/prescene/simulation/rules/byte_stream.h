// SPDX-License-Identifier: Apache-2.0
// Plain values to bytes and back, for snapshots: bits in, bits out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "prescene/geometry/pose.h"

namespace prescene::simulation {

class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}
  template <class T>
  void value(const T& v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &v, sizeof(T));
  }
  void vector(const geometry::Vector3d& v) {
    for (int i = 0; i < 3; ++i) value(v[i]);
  }
  void rotation(const geometry::Quaterniond& q) {
    for (int i = 0; i < 4; ++i) value(q.coeffs()[i]);
  }
  void pose(const geometry::Pose& X) {
    rotation(X.rotation);
    vector(X.translation);
  }

 private:
  std::vector<std::uint8_t>& bytes_;
};

/// Reading beyond the end gives zeros and ok() == false.
class ByteReader {
 public:
  explicit ByteReader(const std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}
  template <class T>
  T value() {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    T v{};
    if (bytes_.size() - at_ < sizeof(T)) {
      ok_ = false;
      at_ = bytes_.size();
      return v;
    }
    std::memcpy(&v, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return v;
  }
  geometry::Vector3d vector() {
    geometry::Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = value<double>();
    return v;
  }
  geometry::Quaterniond rotation() {
    geometry::Quaterniond q;
    for (int i = 0; i < 4; ++i) q.coeffs()[i] = value<double>();
    return q;
  }
  geometry::Pose pose() {
    geometry::Pose X;
    X.rotation = rotation();
    X.translation = vector();
    return X;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  bool ok() const { return ok_; }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const std::vector<std::uint8_t>& bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace prescene::simulation
