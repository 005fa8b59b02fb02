// SPDX-License-Identifier: Apache-2.0
// The directions in which points spread most and least.
#pragma once

#include <Eigen/Core>

namespace prescene::collision {

/// Sums over points, relative to one of them.
class PointMoments {
 public:
  explicit PointMoments(const Eigen::Vector3f& reference) : reference_(reference) {}

  void add(const Eigen::Vector3f& p) {
    const Eigen::Vector3f d = p - reference_;
    sum_ += d;
    squares_ += Eigen::Array3f(d.x() * d.x(), d.y() * d.y(), d.z() * d.z());
    products_ += Eigen::Array3f(d.y() * d.z(), d.z() * d.x(), d.x() * d.y());
    count_ += 1.0F;
  }
  /// `other` has the same reference.
  void add(const PointMoments& other) {
    sum_ += other.sum_;
    squares_ += other.squares_;
    products_ += other.products_;
    count_ += other.count_;
  }

  /// Principal axes as the rows of a rotation, the one of the smallest spread first; false where they cannot be told.
  bool principal_axes(Eigen::Matrix3f* R) const;

 private:
  Eigen::Vector3f reference_;
  Eigen::Vector3f sum_ = Eigen::Vector3f::Zero();
  Eigen::Array3f squares_ = Eigen::Array3f::Zero();   // xx, yy, zz
  Eigen::Array3f products_ = Eigen::Array3f::Zero();  // yz, zx, xy
  float count_ = 0.0F;
};

}  // namespace prescene::collision
