// SPDX-License-Identifier: Apache-2.0
// How a function says that the outside (a file, the bus, a driver, a setting) did not let it do its work.
//
//   Result<TriangleMesh> mesh = read_mesh(path, options);
//   if (!mesh) return mesh.status();   // or PRESCENE_TRY(TriangleMesh mesh, read_mesh(path, options));
//
// The text of a status names the place (file, line, byte, key, topic) and the remedy. Our own bugs are PRESCENE_CHECK.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace prescene::core {

enum class StatusCode {
  kOk,
  kInvalidInput,       ///< The bytes, arguments or settings given are wrong: the sender has to change them.
  kNotFound,           ///< A named thing (file, frame, object, topic) is not there.
  kDataLoss,           ///< A file or message is cut or corrupt.
  kUnsupported,        ///< Valid, but this build or version can't do it.
  kUnavailable,        ///< A device, driver, peer or package is missing now; trying again later may help.
  kResourceExhausted,  ///< More than a limit of this program.
  kCancelled,          ///< Stopped on request.
};

/// "invalid input", "not found", ...
std::string_view to_string(StatusCode code);

/// Success, or a code with a text that names the place and the remedy.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  const std::string& message() const { return message_; }

  /// The same status with "place: " before its message; an ok status stays ok.
  Status at(std::string_view place) const;

  friend bool operator==(const Status&, const Status&) = default;

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

/// "invalid input: cup.ply: ..." or "ok".
std::string to_string(const Status& status);

inline Status ok_status() { return Status(); }
inline Status invalid_input(std::string message) { return Status(StatusCode::kInvalidInput, std::move(message)); }
inline Status not_found(std::string message) { return Status(StatusCode::kNotFound, std::move(message)); }
inline Status data_loss(std::string message) { return Status(StatusCode::kDataLoss, std::move(message)); }
inline Status unsupported(std::string message) { return Status(StatusCode::kUnsupported, std::move(message)); }
inline Status unavailable(std::string message) { return Status(StatusCode::kUnavailable, std::move(message)); }
inline Status resource_exhausted(std::string message) {
  return Status(StatusCode::kResourceExhausted, std::move(message));
}
inline Status cancelled(std::string message) { return Status(StatusCode::kCancelled, std::move(message)); }

/// A value or the status that says why there is none (never an ok status).
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : expected_(std::move(value)) {}                             // NOLINT(google-explicit-constructor)
  Result(Status status) : expected_(tl::make_unexpected(std::move(status))) {  // NOLINT(google-explicit-constructor)
    if (expected_.error().ok())
      expected_.error() = Status(StatusCode::kUnavailable, "a Result was made from an ok Status");
  }

  bool ok() const { return expected_.has_value(); }
  explicit operator bool() const { return ok(); }
  T& operator*() & { return *expected_; }
  const T& operator*() const& { return *expected_; }
  T&& operator*() && { return *std::move(expected_); }
  T* operator->() { return &*expected_; }
  const T* operator->() const { return &*expected_; }
  /// The reason; ok when there is a value.
  Status status() const { return ok() ? Status() : expected_.error(); }

 private:
  tl::expected<T, Status> expected_;
};

}  // namespace prescene::core

#define PRESCENE_CONCAT_INNER(a, b) a##b
#define PRESCENE_CONCAT(a, b) PRESCENE_CONCAT_INNER(a, b)
/// Returns the status from the calling function unless it is ok.
#define PRESCENE_RETURN_IF_ERROR(expression)                 \
  do {                                                       \
    ::prescene::core::Status prescene_status = (expression); \
    if (!prescene_status.ok()) return prescene_status;       \
  } while (false)
/// `PRESCENE_TRY(auto mesh, read_mesh(path));` declares `mesh`, or returns the status from the calling function.
#define PRESCENE_TRY(declaration, expression)                                                                         \
  auto PRESCENE_CONCAT(prescene_result_, __LINE__) = (expression);                                                    \
  if (!PRESCENE_CONCAT(prescene_result_, __LINE__).ok()) return PRESCENE_CONCAT(prescene_result_, __LINE__).status(); \
  declaration = *std::move(PRESCENE_CONCAT(prescene_result_, __LINE__))
