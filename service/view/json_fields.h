// SPDX-License-Identifier: Apache-2.0
// Objects of JSON, field by field: lists of initialisers cost the compiler seconds in every source that writes them.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace prescene::service {

/// ordered_json document = JsonFields().text("op", "step").count("index", 3).take();
class JsonFields {
 public:
  JsonFields& text(const char* key, const std::string& value);
  JsonFields& number(const char* key, double value);
  JsonFields& count(const char* key, std::uint64_t value);
  JsonFields& flag(const char* key, bool value);
  JsonFields& numbers(const char* key, const std::vector<double>& values);
  JsonFields& texts(const char* key, const std::vector<std::string>& values);
  JsonFields& field(const char* key, nlohmann::ordered_json&& value);
  nlohmann::ordered_json take() { return std::move(json_); }

 private:
  nlohmann::ordered_json json_ = nlohmann::ordered_json::object();
};

nlohmann::ordered_json json_numbers(const std::vector<double>& values);

}  // namespace prescene::service
