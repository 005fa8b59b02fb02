// SPDX-License-Identifier: Apache-2.0
// Whatever bytes an SQLite file has, the reader ends: with messages, or with an error that names the file.
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <vector>

#include "db3_files.h"
#include "prescene/core/random.h"
#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/bytes/file.h"
#include "tests/support/paths.h"

namespace prescene::interfaces::db3_damage_test {
namespace {

struct Outcome {
  std::size_t messages = 0;
  std::set<std::vector<std::uint8_t>> distinct;  ///< A damaged index may name a row twice.
  core::Status status;
};

Outcome read(const std::filesystem::path& path, bool salvage) {
  Outcome outcome;
  const auto reader = BagReader::open(path, {.salvage = salvage});
  outcome.status = reader.status();
  while (reader) {
    const auto message = (*reader)->next();
    outcome.status = message.status();
    if (!message || !*message) break;
    outcome.distinct.insert((*message)->data);
    EXPECT_LT(++outcome.messages, 100'000u) << "of a file of some kilobytes";
    if (outcome.messages >= 100'000u) break;
  }
  return outcome;
}

/// PRESCENE_DB3_MUTATIONS files (default 400), each with up to eight wrong bytes, a cut, or a page in the place of
/// another.
TEST(Db3Damage, NeverCrashesAndNamesTheFile) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "bag.db3";
  core::RandomStream stream(7, core::Purpose::kTest);
  std::vector<tests::Db3Message> messages;
  for (int i = 0; i < 40; ++i)
    messages.push_back({1 + i % 2, 1000 + i, std::vector<std::uint8_t>(static_cast<std::size_t>(i * i), 7)});
  tests::write_db3(path, {{"/a", "std_msgs/msg/String"}, {"/b", "tf2_msgs/msg/TFMessage"}}, messages,
                   tests::Db3Layout::kJazzy);
  const auto whole = read_file(path, 1 << 20);
  ASSERT_TRUE(whole.ok());
  ASSERT_EQ(read(path, false).messages, messages.size());
  const char* const given = std::getenv("PRESCENE_DB3_MUTATIONS");
  const int mutations = given ? std::atoi(given) : 400;
  int refused = 0;
  for (int i = 0; i < mutations; ++i) {
    std::vector<std::uint8_t> bytes = *whole;
    const auto below = [&stream](std::size_t n) { return static_cast<std::size_t>(stream.uniform() * n); };
    const std::size_t kind = below(4);
    if (kind == 0) {
      bytes.resize(below(bytes.size()));
    } else if (kind == 1) {
      constexpr std::size_t kPage = 512;
      const std::size_t from = kPage * below(bytes.size() / kPage), to = kPage * below(bytes.size() / kPage);
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(from), kPage,
                  bytes.begin() + static_cast<std::ptrdiff_t>(to));
    } else {
      // Half of them in the first pages: header, schema, roots.
      const std::size_t within = kind == 2 ? bytes.size() : std::size_t{4096};
      for (std::size_t n = 1 + below(8); n > 0; --n) bytes[below(within)] = static_cast<std::uint8_t>(below(256));
    }
    ASSERT_TRUE(write_file(path, bytes).ok());
    const Outcome strict = read(path, false);
    const Outcome salvaged = read(path, true);
    EXPECT_GE(salvaged.distinct.size(), strict.distinct.size()) << i;
    if (strict.status.ok()) continue;
    ++refused;
    EXPECT_NE(strict.status.message().find("bag.db3"), std::string::npos) << strict.status.message();
  }
  EXPECT_GT(refused, mutations / 5);
}

}  // namespace
}  // namespace prescene::interfaces::db3_damage_test
