// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/ros_messages/cdr.h"

#include <bit>
#include <concepts>
#include <cstring>
#include <string>
#include <utility>

#include "message_fields.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/image_view.h"
#include "prescene/interfaces/ros_messages/schemas.h"

namespace prescene::interfaces {
namespace {

using message_fields::Fields;
using message_fields::MinWireSize;

constexpr std::size_t kHeaderBytes = 4;
// Senders may pad the end of a message; more than one alignment unit left over means that it is another type.
constexpr std::size_t kMaxBytesLeftOver = 8;

/// Alignment counts from the byte after the four-byte header, which itself is a multiple of 4 but not of 8; so
/// positions in here are those of the body.
class CdrWriter {
 public:
  CdrWriter() : bytes_{0x00, 0x01, 0x00, 0x00} {}

  template <class T>
  requires std::is_arithmetic_v<T>
  void write(const T& value) {
    const std::size_t position = bytes_.size() - kHeaderBytes;
    const std::size_t padding = (sizeof(T) - position % sizeof(T)) % sizeof(T);
    bytes_.insert(bytes_.end(), padding, 0);
    std::uint8_t raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(raw[std::endian::native == std::endian::little ? i : sizeof(T) - 1 - i]);
    }
  }

  void write(const std::string& text) {
    write_count(text.size() + 1);
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
  }

  void write(const std::vector<std::uint8_t>& data) {
    write_count(data.size());
    bytes_.insert(bytes_.end(), data.begin(), data.end());
  }

  template <class T>
  void write(const std::vector<T>& values) {
    write_count(values.size());
    for (const T& value : values) write(value);
  }

  template <class T, std::size_t n>
  void write(const std::array<T, n>& values) {
    for (const T& value : values) write(value);
  }

  template <class Message>
  requires requires { Fields<Message>::list; }
  void write(const Message& message) {
    std::apply([&](auto... field) { (write(message.*field.member), ...); }, Fields<Message>::list);
  }

  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void write_count(std::size_t count) {
    PRESCENE_CHECK(count <= 0xffffffffU);
    write(static_cast<std::uint32_t>(count));
  }

  std::vector<std::uint8_t> bytes_;
};

class CdrReader {
 public:
  CdrReader(std::span<const std::uint8_t> body, std::endian order, const CdrLimits& limits)
      : in_(body, order), limits_(limits) {}

  template <class T>
  requires std::is_arithmetic_v<T>
  void read(T* value) {
    in_.align(sizeof(T));
    *value = in_.read<T>();
    if (!in_.ok()) fail(core::StatusCode::kDataLoss, "the bytes end here");
  }

  void read(bool* value) {
    std::uint8_t byte = 0;
    read(&byte);
    if (byte > 1) fail(core::StatusCode::kInvalidInput, "a bool is " + std::to_string(byte) + " instead of 0 or 1");
    *value = byte == 1;
  }

  void read(std::string* text) {
    std::uint32_t length = 0;
    read(&length);
    if (!ok() || length == 0) return;  // Some senders write an empty string without its NUL.
    if (length > in_.remaining()) return fail_length("string", length, 1);
    if (length - 1 > limits_.max_string_bytes) {
      return fail(core::StatusCode::kResourceExhausted, "a string of " + size_text(length - 1) +
                                                            " is longer than the limit of " +
                                                            size_text(limits_.max_string_bytes));
    }
    const std::span<const std::uint8_t> raw = in_.take(length);
    if (raw.back() != 0) return fail(core::StatusCode::kInvalidInput, "a string does not end with NUL");
    text->assign(reinterpret_cast<const char*>(raw.data()), raw.size() - 1);
  }

  void read(std::vector<std::uint8_t>* data) {
    std::span<const std::uint8_t> raw;
    read(&raw);
    data->assign(raw.begin(), raw.end());
  }

  /// Where they are.
  void read(std::span<const std::uint8_t>* data) {
    std::uint32_t count = 0;
    read(&count);
    if (!ok()) return;
    if (count > in_.remaining()) return fail_length("sequence", count, 1);
    *data = in_.take(count);
  }

  template <class T>
  void read(std::vector<T>* values) {
    std::uint32_t count = 0;
    read(&count);
    if (!ok()) return;
    if (count > in_.remaining() / MinWireSize<T>::value) return fail_length("sequence", count, MinWireSize<T>::value);
    values->resize(count);
    for (std::size_t i = 0; i < values->size() && ok(); ++i) {
      path_.push_back({nullptr, i});
      read(&(*values)[i]);
      if (ok()) path_.pop_back();
    }
  }

  template <class T, std::size_t n>
  void read(std::array<T, n>* values) {
    for (T& value : *values) read(&value);
  }

  template <class Message>
  requires requires { Fields<Message>::list; }
  void read(Message* message) {
    std::apply([&](auto... field) { (read_field(field.name, &(message->*field.member)), ...); }, Fields<Message>::list);
  }

  bool ok() const { return status_.ok(); }
  const core::Status& status() const { return status_; }
  std::size_t remaining() const { return in_.remaining(); }

 private:
  struct PathStep {
    const char* name;  ///< Or an index when null.
    std::size_t index;
  };

  template <class T>
  void read_field(const char* name, T* value) {
    if (!ok()) return;
    path_.push_back({name, 0});
    read(value);
    if (ok()) path_.pop_back();
  }

  void fail_length(const char* what, std::uint32_t count, std::size_t min_element_bytes) {
    fail(core::StatusCode::kDataLoss, std::string("a ") + what + " of length " + std::to_string(count) +
                                          " needs at least " + size_text(count * min_element_bytes) + ", " +
                                          size_text(in_.remaining()) + " are left");
  }

  void fail(core::StatusCode code, const std::string& what) {
    if (!ok()) return;
    std::string place;
    for (const PathStep& step : path_) {
      if (step.name == nullptr) {
        place += "[" + std::to_string(step.index) + "]";
      } else {
        if (!place.empty()) place += ".";
        place += step.name;
      }
    }
    status_ = core::Status(code, place + ", byte " + std::to_string(in_.position() + kHeaderBytes) + ": " + what);
  }

  ByteReader in_;
  CdrLimits limits_;
  core::Status status_;
  std::vector<PathStep> path_;
};

core::Status check_remedy(const core::Status& status, std::string_view type) {
  const std::string text = std::string(type) + ": " + status.message() +
                           "; the message is cut, or its sender uses another type or version under this name";
  return core::Status(status.code(), text);
}

template <class Message>
core::Result<Message> decode(std::span<const std::uint8_t> bytes, const CdrLimits& limits, std::string_view type) {
  const std::string name(type);
  if (bytes.size() > limits.max_message_bytes) {
    return core::resource_exhausted(name + ": " + size_text(bytes.size()) + " are more than the limit of " +
                                    size_text(limits.max_message_bytes));
  }
  if (bytes.size() < kHeaderBytes) {
    return core::data_loss(name + ": " + size_text(bytes.size()) + " cannot hold the four-byte CDR header");
  }
  if (bytes[0] != 0 || bytes[1] > 1) {
    return core::invalid_input(
        name + ": the CDR header begins with bytes " + std::to_string(bytes[0]) + ", " + std::to_string(bytes[1]) +
        " instead of 0, 0 or 0, 1 (plain CDR version 1); set the sender to XCDR1, as ROS 2 uses");
  }
  CdrReader reader(bytes.subspan(kHeaderBytes), bytes[1] == 1 ? std::endian::little : std::endian::big, limits);
  Message message;
  reader.read(&message);
  if (!reader.ok()) return check_remedy(reader.status(), type);
  if (reader.remaining() > kMaxBytesLeftOver) {
    return core::invalid_input(
        name + ": " + size_text(reader.remaining()) +
        " are left over after the last field; the sender uses another type or version under this "
        "name");
  }
  return message;
}

}  // namespace

template <class Message>
std::vector<std::uint8_t> encode_cdr(const Message& message) {
  CdrWriter writer;
  writer.write(message);
  return writer.take();
}

template <class Message>
core::Result<Message> decode_cdr(std::span<const std::uint8_t> bytes, const CdrLimits& limits) {
  return decode<Message>(bytes, limits, ros_type<Message>().name);
}

core::Result<RosImageView> view_image_cdr(std::span<const std::uint8_t> bytes, const CdrLimits& limits) {
  return decode<RosImageView>(bytes, limits, ros_type<RosImage>().name);
}

#define PRESCENE_INSTANTIATE(Message)                                     \
  template std::vector<std::uint8_t> encode_cdr<Message>(const Message&); \
  template core::Result<Message> decode_cdr<Message>(std::span<const std::uint8_t>, const CdrLimits&);
PRESCENE_FOR_EACH_MESSAGE(PRESCENE_INSTANTIATE)
#undef PRESCENE_INSTANTIATE

}  // namespace prescene::interfaces
