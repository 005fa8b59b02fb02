// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/file_descriptor.h"

#include <fcntl.h>
#include <gtest/gtest.h>

namespace prescene::core {
namespace {

bool is_open(int number) { return ::fcntl(number, F_GETFD) >= 0; }

FileDescriptor opened() { return FileDescriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }

TEST(FileDescriptor, IsClosedAtItsEnd) {
  int number = -1;
  {
    const FileDescriptor file = opened();
    number = file.number();
    EXPECT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
}

TEST(FileDescriptor, ClosesOnce) {
  FileDescriptor file = opened();
  const int number = file.number();
  EXPECT_TRUE(file.close());
  EXPECT_FALSE(is_open(number));
  EXPECT_LT(file.number(), 0);
  const FileDescriptor next = opened();  // of the same number
  EXPECT_TRUE(file.close());
  EXPECT_TRUE(is_open(next.number()));
  EXPECT_TRUE(FileDescriptor().close());
}

TEST(FileDescriptor, GoesFromOneToAnother) {
  FileDescriptor from = opened();
  const int number = from.number();
  FileDescriptor to(std::move(from));
  EXPECT_EQ(to.number(), number);
  {
    FileDescriptor other = opened();
    const int replaced = other.number();
    other = std::move(to);
    EXPECT_EQ(other.number(), number);
    to = FileDescriptor();
    EXPECT_FALSE(is_open(replaced));
    EXPECT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
}

}  // namespace
}  // namespace prescene::core
