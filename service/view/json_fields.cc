// SPDX-License-Identifier: Apache-2.0
#include "json_fields.h"

#include <utility>

namespace prescene::service {

using nlohmann::ordered_json;

JsonFields& JsonFields::field(const char* key, ordered_json&& value) {
  json_[key] = std::move(value);
  return *this;
}
JsonFields& JsonFields::text(const char* key, const std::string& value) { return field(key, ordered_json(value)); }
JsonFields& JsonFields::number(const char* key, double value) { return field(key, ordered_json(value)); }
JsonFields& JsonFields::count(const char* key, std::uint64_t value) { return field(key, ordered_json(value)); }
JsonFields& JsonFields::flag(const char* key, bool value) { return field(key, ordered_json(value)); }
JsonFields& JsonFields::numbers(const char* key, const std::vector<double>& values) {
  return field(key, json_numbers(values));
}
JsonFields& JsonFields::texts(const char* key, const std::vector<std::string>& values) {
  return field(key, ordered_json(values));
}

ordered_json json_numbers(const std::vector<double>& values) { return values; }

}  // namespace prescene::service
