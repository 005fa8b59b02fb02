// SPDX-License-Identifier: Apache-2.0
// A file descriptor that is closed at its end.
#pragma once

#include <unistd.h>

#include <utility>

namespace prescene::core {

class FileDescriptor {
 public:
  FileDescriptor() = default;
  /// Takes the descriptor; a negative number is none, as system calls return it on failure.
  explicit FileDescriptor(int number) : number_(number) {}
  FileDescriptor(FileDescriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~FileDescriptor() { close(); }

  int number() const { return number_; }
  /// False, with the reason in errno, if what was written may be lost. True if it is closed already.
  bool close() { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_ = -1;
};

}  // namespace prescene::core
