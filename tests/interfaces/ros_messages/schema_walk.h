// SPDX-License-Identifier: Apache-2.0
// A second reading of ROS 2 message texts, independent of the codec: from a `ros2msg` schema to its RIHS01 hash and to
// CDR bytes with random values.
#pragma once

#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::tests {

struct SchemaField {
  std::string name;
  std::string type;  ///< "float64", or "pkg/Name" of a nested type.
  bool nested = false;
  bool sequence = false;
  int array = 0;  ///< Length of a fixed array, 0 for none.
  int bound = 0;  ///< Greatest length of a bounded sequence, 0 for none.
};

/// The types of a `ros2msg` schema by "pkg/Name", with the root's own name.
struct Schema {
  std::string root;
  std::string root_name;  ///< "pkg/msg/Name" or "pkg/srv/Name_Request"
  std::map<std::string, std::vector<SchemaField>> types;
};

/// `name` is that of the root, as in root_name.
Schema parse_schema(std::string_view name, std::string_view text);

/// "RIHS01_..." by ROS 2's rule: SHA-256 of the JSON type description.
std::string type_hash(const Schema& schema);

/// CDR of a message of this type with random values (no NaN; sequences and strings of 0 to 3 elements): header and body
/// in the byte order. The same stream gives the same values in both orders.
std::vector<std::uint8_t> random_cdr(const Schema& schema, core::RandomStream stream, std::endian order);

}  // namespace prescene::tests
