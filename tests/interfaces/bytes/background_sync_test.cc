// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/background_sync.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <thread>

#include "prescene/interfaces/bytes/file.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using std::chrono::milliseconds;

TEST(BackgroundSync, WhatWasWrittenIsAtRiskUntilTheDiskHasIt) {
  const tests::ScratchDir scratch;
  auto file = OutputFile::create(scratch.path() / "a");
  ASSERT_TRUE(file.ok());
  const auto sync = BackgroundSync::start(scratch.path() / "a", milliseconds(1));
  ASSERT_TRUE(sync.ok()) << sync.status().message();
  EXPECT_EQ((*sync)->seconds_at_risk(), 0.0);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(file->write(std::vector<std::uint8_t>(1000)).ok());
    (*sync)->note_written();
    while ((*sync)->seconds_at_risk() > 0.0) std::this_thread::yield();
    EXPECT_TRUE((*sync)->status().ok());
  }
}

TEST(BackgroundSync, IsAtRiskWhileTheDiskIsNotAsked) {
  const tests::ScratchDir scratch;
  auto file = OutputFile::create(scratch.path() / "a");
  ASSERT_TRUE(file.ok());
  const auto sync = BackgroundSync::start(scratch.path() / "a", std::chrono::hours(1));
  ASSERT_TRUE(sync.ok());
  (*sync)->note_written();
  const double before = (*sync)->seconds_at_risk();
  EXPECT_GT(before, 0.0);
  (*sync)->note_written();
  EXPECT_GT((*sync)->seconds_at_risk(), before) << "counts from the first of them";
  EXPECT_TRUE(file->close().ok()) << "the other descriptor stays, and the end waits for no hour";
}

TEST(BackgroundSync, TellsThatTheFileWasRemoved) {
  const tests::ScratchDir scratch;
  auto file = OutputFile::create(scratch.path() / "a");
  ASSERT_TRUE(file.ok());
  const auto sync = BackgroundSync::start(scratch.path() / "a", milliseconds(1));
  ASSERT_TRUE(sync.ok());
  std::filesystem::remove(scratch.path() / "a");
  ASSERT_TRUE(file->write(std::vector<std::uint8_t>(1000)).ok()) << "the system keeps it as long as it is open";
  (*sync)->note_written();
  while ((*sync)->seconds_at_risk() > 0.0) std::this_thread::yield();
  EXPECT_EQ((*sync)->status().code(), core::StatusCode::kUnavailable);
  EXPECT_NE((*sync)->status().message().find("/a: was removed while it was written"), std::string::npos)
      << (*sync)->status().message();
}

TEST(BackgroundSync, TellsThatThereIsNoDescriptorLeft) {
  const tests::ScratchDir scratch;
  auto file = OutputFile::create(scratch.path() / "a");
  ASSERT_TRUE(file.ok());
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none{3, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const auto sync = BackgroundSync::start(scratch.path() / "a", milliseconds(1));
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(sync.status().code(), core::StatusCode::kUnavailable);
  EXPECT_NE(sync.status().message().find("/a: cannot be kept on the disk"), std::string::npos)
      << sync.status().message();
}

}  // namespace
}  // namespace prescene::interfaces
