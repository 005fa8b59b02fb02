// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/dds/parameter_client.h"

#include <algorithm>
#include <cstring>

#include <dds/dds.h>

// NOLINTBEGIN(readability-identifier-naming): idlc's names
extern "C" {
#define PRESCENE_DESCRIPTORS(name)                                                    \
  extern const dds_topic_descriptor_t rcl_interfaces_srv_dds__##name##_Request__desc; \
  extern const dds_topic_descriptor_t rcl_interfaces_srv_dds__##name##_Response__desc;
PRESCENE_DESCRIPTORS(ListParameters)
PRESCENE_DESCRIPTORS(GetParameters)
PRESCENE_DESCRIPTORS(GetParameterTypes)
PRESCENE_DESCRIPTORS(DescribeParameters)
PRESCENE_DESCRIPTORS(SetParameters)
PRESCENE_DESCRIPTORS(SetParametersAtomically)
#undef PRESCENE_DESCRIPTORS
}
// NOLINTEND(readability-identifier-naming)

namespace prescene::tests {
namespace {

// As Cyclone has sequences in C.
template <class T>
struct Sequence {
  std::uint32_t maximum = 0, length = 0;
  T* buffer = nullptr;
  bool release = false;
};
template <class T>
Sequence<T> sequence_of(std::vector<T>& items) {
  const auto size = static_cast<std::uint32_t>(items.size());
  return {size, size, items.data(), false};
}

struct ListRequest {
  std::uint64_t guid;
  std::int64_t number;
  Sequence<char*> prefixes;
  std::uint64_t depth;
};
struct NamesRequest {
  std::uint64_t guid;
  std::int64_t number;
  Sequence<char*> names;
};
struct Value {
  std::uint8_t type;
  bool truth;
  std::int64_t whole;
  double number;
  char* text;
  Sequence<std::uint8_t> bytes;
  Sequence<bool> truths;
  Sequence<std::int64_t> wholes;
  Sequence<double> numbers;
  Sequence<char*> texts;
};
struct Parameter {
  char* name;
  Value value;
};
struct SetRequest {
  std::uint64_t guid;
  std::int64_t number;
  Sequence<Parameter> parameters;
};

std::vector<char*> borrowed(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  return pointers;
}

/// Reads little-endian CDR: a field at a time, each aligned to its size.
class Walk {
 public:
  explicit Walk(const std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}
  template <class T>
  T number() {
    at_ += (sizeof(T) - (at_ - kHeader) % sizeof(T)) % sizeof(T);
    T value{};
    if (at_ + sizeof(T) > bytes_.size())
      ok_ = false;
    else
      std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string text() {
    const auto length = number<std::uint32_t>();
    if (length == 0 || at_ + length > bytes_.size()) {
      ok_ = false;
      return "";
    }
    std::string text(reinterpret_cast<const char*>(bytes_.data()) + at_, length - 1);
    at_ += length;
    return text;
  }
  template <class Read>
  auto all(Read read) {
    std::vector<decltype(read())> items;
    for (auto left = number<std::uint32_t>(); left > 0 && ok_; --left) items.push_back(read());
    return items;
  }
  std::vector<std::string> texts() {
    return all([this] { return text(); });
  }
  ParamValue value() {
    ParamValue value;
    value.type = number<std::uint8_t>();
    value.truth = number<std::uint8_t>() == 1;
    value.whole = number<std::int64_t>();
    value.number = number<double>();
    value.text = text();
    all([this] { return number<std::uint8_t>(); });
    all([this] { return number<std::uint8_t>(); });
    all([this] { return number<std::int64_t>(); });
    value.row = all([this] { return number<double>(); });
    texts();
    return value;
  }
  ParamResult result() {
    const bool successful = number<std::uint8_t>() == 1;
    return {successful, text()};
  }
  /// Whether all was there, and no more: Cyclone pads to four bytes.
  bool done() const { return ok_ && at_ <= bytes_.size() && bytes_.size() - at_ < 4; }

 private:
  static constexpr std::size_t kHeader = 4;
  const std::vector<std::uint8_t>& bytes_;
  std::size_t at_ = 20;  // behind the header, the client and the number
  bool ok_ = true;
};

/// What `read` makes of a reply.
template <class Read>
auto parsed(const std::optional<std::vector<std::uint8_t>>& bytes, Read read)
    -> std::optional<decltype(read(std::declval<Walk&>()))> {
  if (!bytes) return std::nullopt;
  Walk walk(*bytes);
  auto what = read(walk);
  if (!walk.done()) return std::nullopt;
  return what;
}

}  // namespace

ParameterClient::ParameterClient(int domain, const std::string& node) {
  const auto add = [&](const char* name, const dds_topic_descriptor_t& request,
                       const dds_topic_descriptor_t& response) {
    services_.push_back(std::make_unique<ServiceClient>(domain, node + "/" + name, request, response));
  };
#define PRESCENE_CLIENT(name, type) \
  add(name, rcl_interfaces_srv_dds__##type##_Request__desc, rcl_interfaces_srv_dds__##type##_Response__desc);
  PRESCENE_CLIENT("list_parameters", ListParameters)
  PRESCENE_CLIENT("get_parameters", GetParameters)
  PRESCENE_CLIENT("get_parameter_types", GetParameterTypes)
  PRESCENE_CLIENT("describe_parameters", DescribeParameters)
  PRESCENE_CLIENT("set_parameters", SetParameters)
  PRESCENE_CLIENT("set_parameters_atomically", SetParametersAtomically)
#undef PRESCENE_CLIENT
}

bool ParameterClient::wait_for_services() {
  return std::all_of(services_.begin(), services_.end(),
                     [](const auto& service) { return service->wait_for_service(); });
}

std::optional<std::array<std::vector<std::string>, 2>> ParameterClient::list(const std::vector<std::string>& prefixes,
                                                                             std::uint64_t depth) {
  std::vector<char*> texts = borrowed(prefixes);
  ListRequest request{0, 0, sequence_of(texts), depth};
  return parsed(services_[kList]->take_reply(services_[kList]->send_sample(&request)), [](Walk& walk) {
    std::array<std::vector<std::string>, 2> both;
    for (auto& texts_of : both) texts_of = walk.texts();
    return both;
  });
}

std::optional<std::vector<std::uint8_t>> ParameterClient::ask_names(Call call, const std::vector<std::string>& names) {
  std::vector<char*> texts = borrowed(names);
  NamesRequest request{0, 0, sequence_of(texts)};
  return services_[call]->take_reply(services_[call]->send_sample(&request));
}

std::optional<std::vector<ParamValue>> ParameterClient::get(const std::vector<std::string>& names) {
  return parsed(ask_names(kGet, names), [](Walk& walk) { return walk.all([&] { return walk.value(); }); });
}

std::optional<std::vector<int>> ParameterClient::types(const std::vector<std::string>& names) {
  return parsed(ask_names(kTypes, names),
                [](Walk& walk) { return walk.all([&]() -> int { return walk.number<std::uint8_t>(); }); });
}

std::optional<std::vector<ParamDescription>> ParameterClient::describe(const std::vector<std::string>& names) {
  return parsed(ask_names(kDescribe, names), [](Walk& walk) {
    return walk.all([&] {
      ParamDescription one;
      one.name = walk.text();
      one.type = walk.number<std::uint8_t>();
      one.description = walk.text();
      one.constraints = walk.text();
      one.read_only = walk.number<std::uint8_t>() == 1;
      walk.number<std::uint8_t>();  // dynamic_typing
      one.range = walk.all([&] {
        std::array<double, 3> range{};
        for (double& value : range) value = walk.number<double>();
        return range;
      });
      walk.all([&] { return walk.number<std::int64_t>() + walk.number<std::int64_t>() + walk.number<std::int64_t>(); });
      return one;
    });
  });
}

std::optional<std::vector<std::uint8_t>> ParameterClient::send_wishes(Call call, const Wishes& wishes) {
  std::vector<Parameter> parameters;
  std::vector<std::vector<double>> rows;
  for (const auto& [name, value] : wishes) {
    Parameter& parameter = parameters.emplace_back();
    parameter.name = const_cast<char*>(name.c_str());
    parameter.value.type = static_cast<std::uint8_t>(value.type);
    parameter.value.truth = value.truth;
    parameter.value.whole = value.whole;
    parameter.value.number = value.number;
    parameter.value.text = const_cast<char*>(value.text.c_str());
    rows.push_back(value.row);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) parameters[i].value.numbers = sequence_of(rows[i]);
  SetRequest request{0, 0, sequence_of(parameters)};
  return services_[call]->take_reply(services_[call]->send_sample(&request));
}

std::optional<std::vector<ParamResult>> ParameterClient::set(const Wishes& wishes) {
  return parsed(send_wishes(kSet, wishes), [](Walk& walk) { return walk.all([&] { return walk.result(); }); });
}

std::optional<ParamResult> ParameterClient::set_atomically(const Wishes& wishes) {
  return parsed(send_wishes(kSetAtomically, wishes), [](Walk& walk) { return walk.result(); });
}

}  // namespace prescene::tests
