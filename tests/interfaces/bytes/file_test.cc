// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <iterator>
#include <utility>

#include "tests/support/paths.h"

namespace prescene::interfaces::file_test {
namespace {

using core::StatusCode;

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

TEST(ReadFile, ReturnsWhatWriteFileWrote) {
  const tests::ScratchDir dir;
  const auto path = dir.path() / "a.bin";
  ASSERT_TRUE(write_file(path, "one").ok());
  ASSERT_TRUE(write_file(path, "two!").ok()) << "an existing file is replaced";
  EXPECT_EQ(*read_file(path, 4), bytes_of("two!"));
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "a.bin.partial"));
}

TEST(FilesBeside, AreRemovedUnlessTheyHaveTheNameThatTheyWereFor) {
  const tests::ScratchDir dir;
  const auto is_empty = [&] { return std::filesystem::is_empty(dir.path()); };
  const auto finished = dir.path() / "whole.bin";
  // More than are remembered, if those that are gone did not make room.
  for (int i = 0; i < 200; ++i) {
    const auto aside = create_beside(finished);
    ASSERT_TRUE(aside.ok()) << aside.status().message();
    if (i % 2 == 0) std::filesystem::remove(*aside);
    if (i % 2 == 1) std::filesystem::rename(*aside, finished);
  }
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(create_beside(finished).ok());
  remove_files_beside();
  EXPECT_TRUE(std::filesystem::exists(finished));
  std::filesystem::remove(finished);
  EXPECT_TRUE(is_empty());
  // It can go on afterwards.
  ASSERT_TRUE(create_beside(finished).ok());
  EXPECT_FALSE(is_empty());
  remove_files_beside();
  EXPECT_TRUE(is_empty());
}

TEST(ReadFile, NamesThePathAndTheRemedy) {
  const tests::ScratchDir dir;
  const auto missing = read_file(dir.path() / "none.ply", 100).status();
  EXPECT_EQ(missing.code(), StatusCode::kNotFound);
  EXPECT_NE(missing.message().find("none.ply: no such file; check the path"), std::string::npos) << missing.message();

  EXPECT_EQ(read_file(dir.path(), 100).status().code(), StatusCode::kInvalidInput) << "a folder";

  const auto pipe = dir.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(read_file(pipe, 100).status().code(), StatusCode::kInvalidInput) << "a named pipe must not block";

  ASSERT_TRUE(write_file(dir.path() / "big", "12345").ok());
  const auto capped = read_file(dir.path() / "big", 4).status();
  EXPECT_EQ(capped.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(capped.message().find("5 bytes are more than the limit of 4 bytes"), std::string::npos) << capped.message();
}

TEST(WriteFile, SaysThatTheFolderIsMissing) {
  const tests::ScratchDir dir;
  const auto status = write_file(dir.path() / "no" / "a", "x");
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("folder does not exist"), std::string::npos) << status.message();
}

TEST(WriteFile, NamesTheFileThatWasAskedForAndTheSystemsReason) {
  if (!std::filesystem::is_directory("/proc")) GTEST_SKIP() << "this system has no /proc";
  const auto status = write_file("/proc/picture.png", "x");  // a folder that takes no new files
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("/proc/picture.png: cannot be written: "), std::string::npos) << status.message();
  EXPECT_EQ(status.message().find(".partial"), std::string::npos) << status.message();
  EXPECT_EQ(status.message().find("does not exist"), std::string::npos) << status.message();
}

TEST(WriteFile, WritesToAPipeAndLeavesItThere) {
  const tests::ScratchDir dir;
  const std::filesystem::path pipe = dir.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDWR | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  EXPECT_TRUE(write_file(pipe, "text").ok());
  EXPECT_TRUE(std::filesystem::is_fifo(pipe)) << "replaced by a file";
  std::array<char, 8> read_back{};
  EXPECT_EQ(read(reader, read_back.data(), read_back.size()), 4);
  close(reader);
}

TEST(WriteFile, KeepsALinkAndReplacesWhatItNames) {
  const tests::ScratchDir dir;
  ASSERT_TRUE(write_file(dir.path() / "a", "old").ok());
  std::filesystem::create_symlink("a", dir.path() / "link");
  ASSERT_TRUE(write_file(dir.path() / "link", "newer").ok());
  EXPECT_TRUE(std::filesystem::is_symlink(dir.path() / "link"));
  EXPECT_EQ(std::filesystem::file_size(dir.path() / "a"), 5U);
}

TEST(WriteFile, TouchesNoOtherFileAndLeavesNone) {
  const tests::ScratchDir dir;
  ASSERT_TRUE(write_file(dir.path() / "a.partial", "another's").ok());
  ASSERT_TRUE(write_file(dir.path() / "a", "new").ok());
  EXPECT_EQ(*read_file(dir.path() / "a.partial", 100), bytes_of("another's"));
  const mode_t mask = umask(0);
  umask(mask);
  EXPECT_EQ(static_cast<mode_t>(std::filesystem::status(dir.path() / "a").permissions()), 0666 & ~mask);
  // A name as long as names may be.
  ASSERT_TRUE(write_file(dir.path() / std::string(255, 'b'), "long").ok());
  EXPECT_FALSE(write_file(dir.path() / std::string(256, 'b'), "longer").ok());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 3) << "files were left";
}

TEST(WriteFile, RefusesAFolder) {
  const tests::ScratchDir dir;
  EXPECT_EQ(write_file(dir.path(), "x").code(), StatusCode::kUnavailable);
}

TEST(OutputFile, ReportsAFullDisk) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  auto file = OutputFile::create("/dev/full");
  ASSERT_TRUE(file.ok()) << file.status().message();
  const auto status = file->write(bytes_of("x"));
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("/dev/full: cannot be written"), std::string::npos) << status.message();
}

TEST(InputFile, ReadsAnywhereAndSaysWhereTheFileEnds) {
  const tests::ScratchDir dir;
  ASSERT_TRUE(write_file(dir.path() / "a", "0123456789").ok());
  auto opened = InputFile::open(dir.path() / "a");
  ASSERT_TRUE(opened.ok());
  const InputFile file = std::move(*opened);
  EXPECT_EQ(file.size(), 10U);
  std::vector<std::uint8_t> out(3);
  ASSERT_TRUE(file.read(7, out).ok());
  EXPECT_EQ(out, bytes_of("789"));
  EXPECT_EQ(file.read(8, out).code(), StatusCode::kDataLoss);
}

}  // namespace
}  // namespace prescene::interfaces::file_test
