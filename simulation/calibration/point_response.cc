// SPDX-License-Identifier: Apache-2.0
#include "point_response.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::simulation {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of u, for differences of slopes, which are smooth.
constexpr double kDifference = 0.05;

double distance(double squared, double width_squared) { return 0.5 * std::log1p(squared / width_squared); }

}  // namespace

std::vector<double> recording_scores(const Observations& observations, const MatrixXd& simulated) {
  std::vector<double> sums(static_cast<std::size_t>(observations.count()), 0.0);
  std::vector<int> views(sums.size(), 0);
  const Index samples = observations.samples;
  const double w2 = observations.width * observations.width;
  for (Index view = 0; view < observations.points.cols(); ++view) {
    const auto points = simulated.middleCols(view * samples, samples);
    double to_truth = 0.0;
    double to_each_other = 0.0;
    for (Index i = 0; i < samples; ++i) {
      to_truth += distance((points.col(i) - observations.points.col(view)).squaredNorm(), w2);
      for (Index k = 0; k < i; ++k) to_each_other += distance((points.col(i) - points.col(k)).squaredNorm(), w2);
    }
    const auto n = static_cast<double>(samples);
    const auto recording = static_cast<std::size_t>(observations.recordings[static_cast<std::size_t>(view)]);
    sums[recording] += to_truth / n - to_each_other / (n * (n - 1.0));
    ++views[recording];
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= views[i];
  return sums;
}

PointResponse::PointResponse(const Observations& observations, const MatrixXd& trials,
                             const std::vector<MatrixXd>& simulated)
    : observations_(observations), parameters_(trials.cols()) {
  const Index count = trials.rows();
  const Index rows = observations.points.rows() * observations.samples;  // Numbers of a view.
  MatrixXd design(count, 1 + parameters_);
  design << VectorXd::Ones(count), trials;
  const MatrixXd inverse = geometry::pseudo_inverse(design);
  const VectorXd uncertainty = inverse.bottomRows(parameters_).rowwise().squaredNorm();
  const double freedom = std::max(1.0, static_cast<double>(count - design.cols()));
  MatrixXd table(count, rows);
  for (Index view = 0; view < observations.points.cols(); ++view) {
    for (Index trial = 0; trial < count; ++trial) {
      table.row(trial) =
          Eigen::Map<const Eigen::RowVectorXd>(simulated[static_cast<std::size_t>(trial)].data() + view * rows, rows);
    }
    const MatrixXd coefficients = geometry::product(inverse, table);
    const double variance =
        (table - geometry::product(design, coefficients)).squaredNorm() / (freedom * static_cast<double>(rows));
    middles_.emplace_back(coefficients.row(0).transpose());
    MatrixXd response = coefficients.bottomRows(parameters_).transpose();
    // What chance alone makes of a response is taken off [James & Stein 1961]: it would look like information.
    for (Index p = 0; p < parameters_; ++p) {
      const double size = response.col(p).squaredNorm() / static_cast<double>(rows);
      response.col(p) *= size > 0.0 ? std::max(0.0, 1.0 - variance * uncertainty[p] / size) : 0.0;
    }
    responses_.push_back(std::move(response));
    const auto dimension = static_cast<double>(observations.points.rows());
    widths_squared_.push_back(observations.width * observations.width + dimension * variance);
  }
}

MatrixXd PointResponse::slopes_of_points(Index view, const MatrixXd& points) const {
  const double w2 = widths_squared_[static_cast<std::size_t>(view)];
  const auto n = static_cast<double>(points.cols());
  MatrixXd slopes(points.rows(), points.cols());
  VectorXd apart(points.rows());
  for (Index i = 0; i < points.cols(); ++i) {
    apart = points.col(i) - observations_.points.col(view);
    slopes.col(i) = apart / ((w2 + apart.squaredNorm()) * n);
  }
  for (Index i = 0; i < points.cols(); ++i) {
    for (Index k = 0; k < i; ++k) {
      apart = points.col(i) - points.col(k);
      apart /= (w2 + apart.squaredNorm()) * n * (n - 1.0);
      slopes.col(i) -= apart;
      slopes.col(k) += apart;
    }
  }
  return slopes;
}

MatrixXd PointResponse::slopes(const VectorXd& u) const {
  MatrixXd result = MatrixXd::Zero(observations_.count(), parameters_);
  std::vector<int> views(static_cast<std::size_t>(observations_.count()), 0);
  for (std::size_t view = 0; view < responses_.size(); ++view) {
    const VectorXd numbers = middles_[view] + responses_[view] * u;
    const Eigen::Map<const MatrixXd> points(numbers.data(), observations_.points.rows(), observations_.samples);
    const MatrixXd slopes = slopes_of_points(static_cast<Index>(view), points);
    const int recording = observations_.recordings[view];
    result.row(recording) +=
        (responses_[view].transpose() * Eigen::Map<const VectorXd>(slopes.data(), slopes.size())).transpose();
    ++views[static_cast<std::size_t>(recording)];
  }
  for (Index i = 0; i < result.rows(); ++i) result.row(i) /= views[static_cast<std::size_t>(i)];
  return result;
}

std::vector<MatrixXd> PointResponse::curvatures(const VectorXd& u) const {
  std::vector<MatrixXd> all(static_cast<std::size_t>(observations_.count()), MatrixXd(parameters_, parameters_));
  for (Index p = 0; p < parameters_; ++p) {
    VectorXd up = u;
    VectorXd down = u;
    up[p] += kDifference;
    down[p] -= kDifference;
    const MatrixXd change = (slopes(up) - slopes(down)) / (2.0 * kDifference);
    for (std::size_t i = 0; i < all.size(); ++i) all[i].col(p) = change.row(static_cast<Index>(i)).transpose();
  }
  return all;
}

MatrixXd PointResponse::curvature(const VectorXd& u) const {
  MatrixXd result(parameters_, parameters_);
  for (Index p = 0; p < parameters_; ++p) {
    VectorXd up = u;
    VectorXd down = u;
    up[p] += kDifference;
    down[p] -= kDifference;
    result.col(p) = (slopes(up).colwise().mean() - slopes(down).colwise().mean()).transpose() / (2.0 * kDifference);
  }
  return 0.5 * (result + result.transpose());
}

}  // namespace prescene::simulation
