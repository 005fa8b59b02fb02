// SPDX-License-Identifier: Apache-2.0
// What `ros2 param` does, over rmw_cyclonedds_cpp: the services of a node's parameters, called on Cyclone's own
// interface, with structs and a reader of bytes of its own. Each call is nothing where no reply comes within half a
// minute, or one that is not as it should be.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/interfaces/dds/service_client.h"

namespace prescene::tests {

/// A value as ROS numbers its types: 0 none, 1 bool, 2 integer, 3 double, 4 string, 8 doubles.
struct ParamValue {
  int type = 0;
  bool truth = false;
  std::int64_t whole = 0;
  double number = 0.0;
  std::string text = {};
  std::vector<double> row = {};
  static ParamValue of(bool value) { return {.type = 1, .truth = value}; }
  static ParamValue of(std::int64_t value) { return {.type = 2, .whole = value}; }
  static ParamValue of(double value) { return {.type = 3, .number = value}; }
  static ParamValue of(const char* value) { return {.type = 4, .text = value}; }
  friend bool operator==(const ParamValue&, const ParamValue&) = default;
};
struct ParamDescription {
  std::string name;
  int type = 0;
  std::string description, constraints;
  bool read_only = false;
  std::vector<std::array<double, 3>> range;  ///< From, to, step of a number with a fraction.
};
struct ParamResult {
  bool successful = false;
  std::string reason;
};

class ParameterClient {
 public:
  /// Of the node "/prescene" in a domain.
  ParameterClient(int domain, const std::string& node);

  bool wait_for_services();
  /// Names, then prefixes.
  std::optional<std::array<std::vector<std::string>, 2>> list(const std::vector<std::string>& prefixes = {},
                                                              std::uint64_t depth = 0);
  std::optional<std::vector<ParamValue>> get(const std::vector<std::string>& names);
  std::optional<std::vector<int>> types(const std::vector<std::string>& names);
  std::optional<std::vector<ParamDescription>> describe(const std::vector<std::string>& names);
  using Wishes = std::vector<std::pair<std::string, ParamValue>>;
  std::optional<std::vector<ParamResult>> set(const Wishes& wishes);
  std::optional<ParamResult> set_atomically(const Wishes& wishes);

 private:
  enum Call { kList, kGet, kTypes, kDescribe, kSet, kSetAtomically };
  std::optional<std::vector<std::uint8_t>> ask_names(Call call, const std::vector<std::string>& names);
  std::optional<std::vector<std::uint8_t>> send_wishes(Call call, const Wishes& wishes);

  std::vector<std::unique_ptr<ServiceClient>> services_;
};

}  // namespace prescene::tests
