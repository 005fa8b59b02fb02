// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/ros_messages/schema_walk.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <sstream>

#include "prescene/core/check.h"
#include "tests/interfaces/ros_messages/sha256.h"

namespace prescene::tests {
namespace {

const std::map<std::string, int> kTypeIds = {
    {"int8", 2},   {"uint8", 3},    {"int16", 4},    {"uint16", 5}, {"int32", 6}, {"uint32", 7}, {"int64", 8},
    {"uint64", 9}, {"float32", 10}, {"float64", 11}, {"char", 3},   {"bool", 15}, {"byte", 16},  {"string", 17}};

std::string package_of(const std::string& name) { return name.substr(0, name.find('/')); }

SchemaField parse_field(const std::string& line, const std::string& package) {
  std::istringstream words(line);
  SchemaField field;
  words >> field.type >> field.name;
  if (const std::size_t bracket = field.type.find('['); bracket != std::string::npos) {
    const std::string count = field.type.substr(bracket + 1, field.type.size() - bracket - 2);
    const bool is_bounded = count.starts_with("<=");
    field.sequence = count.empty() || is_bounded;
    if (is_bounded) field.bound = std::stoi(count.substr(2));
    if (!field.sequence) field.array = std::stoi(count);
    field.type.resize(bracket);
  }
  field.nested = kTypeIds.count(field.type) == 0;
  if (field.nested && field.type.find('/') == std::string::npos) field.type = package + "/" + field.type;
  return field;
}

std::string long_name(const std::string& name) { return package_of(name) + "/msg/" + name.substr(name.find('/') + 1); }

std::string description(const Schema& schema, const std::string& type) {
  std::string out =
      "{\"type_name\": \"" + (type == schema.root ? schema.root_name : long_name(type)) + "\", \"fields\": [";
  std::string separator;
  for (const SchemaField& field : schema.types.at(type)) {
    const int id = (field.nested ? 1 : kTypeIds.at(field.type)) +
                   (field.bound > 0  ? 96
                    : field.sequence ? 144
                                     : 0) +
                   (field.array > 0 ? 48 : 0);
    out += separator + "{\"name\": \"" + field.name + "\", \"type\": {\"type_id\": " + std::to_string(id) +
           ", \"capacity\": " + std::to_string(std::max(field.array, field.bound)) +
           ", \"string_capacity\": 0, \"nested_type_name\": \"" + (field.nested ? long_name(field.type) : "") + "\"}}";
    separator = ", ";
  }
  return out + "]}";
}

class RandomCdr {
 public:
  RandomCdr(const Schema& schema, core::RandomStream* stream, std::endian order)
      : schema_(schema), stream_(stream), order_(order) {}

  void message(const std::string& type) {
    for (const SchemaField& field : schema_.types.at(type)) {
      std::uint32_t count = 1;
      if (field.array > 0) count = static_cast<std::uint32_t>(field.array);
      if (field.sequence) {
        count = static_cast<std::uint32_t>(
            stream_->uniform_below(field.bound > 0 ? static_cast<std::uint64_t>(field.bound) + 1 : 4));
        number(count);
      }
      for (std::uint32_t i = 0; i < count; ++i) element(field);
    }
  }

  std::vector<std::uint8_t> bytes;

 private:
  void element(const SchemaField& field) {
    if (field.nested) return message(field.type);
    if (field.type == "string") {
      const auto length = static_cast<std::uint32_t>(stream_->uniform_below(4));
      number(length + 1);
      for (std::uint32_t i = 0; i < length; ++i)
        bytes.push_back(static_cast<std::uint8_t>('a' + stream_->uniform_below(26)));
      bytes.push_back(0);
    } else if (field.type == "bool") {
      bytes.push_back(static_cast<std::uint8_t>(stream_->uniform_below(2)));
    } else if (field.type == "byte" || field.type == "uint8") {
      bytes.push_back(static_cast<std::uint8_t>(stream_->uniform_below(256)));
    } else if (field.type == "int32" || field.type == "uint32") {
      number(stream_->next_u32());
    } else if (field.type == "int64" || field.type == "uint64") {
      number(stream_->next_u64());
    } else if (field.type == "float32") {
      number(static_cast<float>(stream_->normal()));
    } else {
      PRESCENE_CHECK(field.type == "float64");
      number(stream_->normal());
    }
  }

  template <class T>
  void number(T value) {
    while (bytes.size() % sizeof(T) != 0) bytes.push_back(0);
    std::uint8_t raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes.push_back(raw[order_ == std::endian::native ? i : sizeof(T) - 1 - i]);
    }
  }

  const Schema& schema_;
  core::RandomStream* stream_;
  std::endian order_;
};

}  // namespace

Schema parse_schema(std::string_view name, std::string_view text) {
  Schema schema;
  const std::string root(name);
  schema.root_name = root;
  schema.root = package_of(root) + root.substr(root.rfind('/'));
  std::string current = schema.root;
  schema.types[current];
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    if (line == std::string(80, '=')) {
      std::getline(lines, line);
      PRESCENE_CHECK(line.starts_with("MSG: "));
      current = line.substr(5);
      PRESCENE_CHECK_MSG(schema.types.count(current) == 0, current);
      schema.types[current];
      continue;
    }
    schema.types[current].push_back(parse_field(line, package_of(current)));
  }
  return schema;
}

std::string type_hash(const Schema& schema) {
  std::string json =
      "{\"type_description\": " + description(schema, schema.root) + ", \"referenced_type_descriptions\": [";
  std::string separator;
  for (const auto& [name, fields] : schema.types) {  // Ordered by name, as the rule asks.
    if (name == schema.root) continue;
    json += separator + description(schema, name);
    separator = ", ";
  }
  return "RIHS01_" + sha256(json + "]}");
}

std::vector<std::uint8_t> random_cdr(const Schema& schema, core::RandomStream stream, std::endian order) {
  RandomCdr walk(schema, &stream, order);
  walk.message(schema.root);
  std::vector<std::uint8_t> out(4 + walk.bytes.size());
  out[1] = order == std::endian::little ? 1 : 0;
  std::copy(walk.bytes.begin(), walk.bytes.end(), out.begin() + 4);
  return out;
}

}  // namespace prescene::tests
