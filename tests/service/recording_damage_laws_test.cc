// SPDX-License-Identifier: Apache-2.0
// A recording that is damaged anywhere is refused, or gives the bits that were recorded; one that was cut gives those
// before the cut, and says that it was.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "prescene/core/random.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/recording/recording.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::recording_damage_laws_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kFlips = 2000;
constexpr int kCuts = 500;
/// All that a recording gives.
struct Content {
  RecordingInfo info;
  std::vector<RecordedEntry> entries;
  bool refused = false;
  std::string loss;
};

bool same(const RecordingInfo& a, const RecordingInfo& b) {
  return a.scene_file == b.scene_file && a.scene_text == b.scene_text && a.seed == b.seed && a.settings == b.settings;
}

bool same(const RecordedEntry& a, const RecordedEntry& b) {
  return a.message.topic == b.message.topic && a.message.type == b.message.type && a.message.cdr == b.message.cdr &&
         a.message.source_ns == b.message.source_ns && a.message.received_ns == b.message.received_ns &&
         a.is_json == b.is_json && a.index == b.index;
}

class RecordingDamageLaws : public ::testing::Test {
 protected:
  void SetUp() override {
    const core::Status recorded =
        tests::record_scene(scene_text_, {"box.yaml", scene_text_, 1, R"({"world_frame": "world"})"}, 20.0, path_);
    ASSERT_TRUE(recorded.ok()) << recorded.message();
    bytes_ = *interfaces::read_file(path_, std::size_t{1} << 30);
    whole_ = content_of(bytes_);
    ASSERT_FALSE(whole_.refused);
    ASSERT_EQ(whole_.loss, "");
    ASSERT_GT(whole_.entries.size(), 50U);
  }

  Content content_of(const Bytes& bytes, const RecordingReadOptions& options = {}) const {
    const auto file = folder_.path() / "damaged.mcap";
    EXPECT_TRUE(interfaces::write_file(file, bytes).ok());
    Content content;
    const auto reader = RecordingReader::open(file, options);
    content.refused = !reader;
    if (!reader) {
      EXPECT_FALSE(reader.status().message().empty());
      return content;
    }
    content.info = (*reader)->info();
    for (;;) {
      auto entry = (*reader)->next();
      content.refused = !entry;
      if (!entry || !*entry) break;
      content.entries.push_back(**std::move(entry));
    }
    content.loss = (*reader)->loss_text();
    return content;
  }

  bool is_whole(const Content& content) const {
    return same(content.info, whole_.info) && content.entries.size() == whole_.entries.size() && begins_whole(content);
  }

  bool begins_whole(const Content& content) const {
    return content.entries.size() <= whole_.entries.size() &&
           std::equal(content.entries.begin(), content.entries.end(), whole_.entries.begin(),
                      [](const auto& a, const auto& b) { return same(a, b); });
  }

  /// Where to do harm: a third each anywhere, in the first and in the last two kilobytes, where there is no chunk with
  /// a checksum of its own around.
  static std::size_t place_in(std::size_t size, int i, core::RandomStream& stream) {
    const std::size_t edge = std::min<std::size_t>(size, 2048);
    if (i % 3 == 0) return stream.uniform_below(size);
    const std::size_t within = stream.uniform_below(edge);
    return i % 3 == 1 ? within : size - 1 - within;
  }

  tests::ScratchDir folder_;
  const std::string scene_text_ = tests::box_on_table("0.8");
  std::filesystem::path path_ = folder_.path() / "run.mcap";
  Bytes bytes_;
  Content whole_;
};

TEST_F(RecordingDamageLaws, AFlippedBitIsNoticedOrChangesNothing) {
  core::RandomStream stream(1, core::Purpose::kTest);
  int refused = 0;
  for (int i = 0; i < kFlips; ++i) {
    const std::size_t at = place_in(bytes_.size(), i, stream);
    const auto bit = static_cast<std::uint8_t>(1U << stream.uniform_below(8));
    Bytes damaged = bytes_;
    damaged[at] ^= bit;
    const Content content = content_of(damaged);
    ASSERT_TRUE(begins_whole(content)) << "bit " << int{bit} << " of byte " << at << " of " << bytes_.size();
    refused += content.refused ? 1 : 0;
    if (content.refused) continue;
    ASSERT_TRUE(same(content.info, whole_.info)) << "bit " << int{bit} << " of byte " << at;
    ASSERT_EQ(content.entries.size(), whole_.entries.size()) << "bit " << int{bit} << " of byte " << at;
    ASSERT_TRUE(content.loss.empty() || at >= bytes_.size() - 2048) << at << ": " << content.loss;
  }
  EXPECT_GT(refused, kFlips * 9 / 10);
  std::printf("compared: %d flipped bits: %d refused, %d gave the same bits\n", kFlips, refused, kFlips - refused);
}

TEST_F(RecordingDamageLaws, ACutGivesWhatWasBeforeIt) {
  core::RandomStream stream(2, core::Purpose::kTest);
  int refused = 0;
  for (int i = 0; i < kCuts; ++i) {
    const std::size_t length = place_in(bytes_.size(), i, stream);
    const Content content = content_of({bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(length)});
    ASSERT_TRUE(begins_whole(content)) << length;
    refused += content.refused ? 1 : 0;
    if (content.refused) continue;
    ASSERT_NE(content.loss, "") << length;
    // Cut before its end, the description is not there at all: then nothing says which scene it is.
    ASSERT_TRUE(same(content.info, whole_.info) || (content.entries.empty() && same(content.info, {}))) << length;
  }
  std::printf("compared: %d cuts: %d refused, %d gave what was before them\n", kCuts, refused, kCuts - refused);
}

TEST_F(RecordingDamageLaws, AFlippedBitInTheSceneOfACutRecordingIsNoticed) {
  // A cut takes the checksum of the data section with it.
  core::RandomStream stream(3, core::Purpose::kTest);
  const Bytes cut(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(bytes_.size() / 2));
  const std::string& text = scene_text_;
  const auto scene = std::search(cut.begin(), cut.end(), text.begin(), text.end());
  ASSERT_NE(scene, cut.end());
  const auto begin = static_cast<std::size_t>(scene - cut.begin());
  for (int i = 0; i < 300; ++i) {
    Bytes damaged = cut;
    damaged[begin + stream.uniform_below(text.size())] ^= static_cast<std::uint8_t>(1U << stream.uniform_below(8));
    ASSERT_TRUE(content_of(damaged).refused);
    const Content salvaged = content_of(damaged, {.salvage = true});
    ASSERT_FALSE(salvaged.refused);
    ASSERT_TRUE(same(salvaged.info, {}));
    ASSERT_NE(salvaged.loss.find("scene, seed and settings are damaged"), std::string::npos) << salvaged.loss;
    ASSERT_TRUE(begins_whole(salvaged));
  }
}

TEST_F(RecordingDamageLaws, WhatIsSalvagedSaysWhatIsLost) {
  core::RandomStream stream(4, core::Purpose::kTest);
  for (int i = 0; i < 600; ++i) {
    const std::size_t at = place_in(bytes_.size(), i, stream);
    const auto bit = static_cast<std::uint8_t>(1U << stream.uniform_below(8));
    Bytes damaged = bytes_;
    damaged[at] ^= bit;
    const Content content = content_of(damaged, {.salvage = true});
    if (content.refused || !content.loss.empty()) continue;
    ASSERT_TRUE(is_whole(content)) << "bit " << int{bit} << " of byte " << at << " of " << bytes_.size();
  }
}

TEST_F(RecordingDamageLaws, ADescriptionWithoutItsChecksumIsNotBelieved) {
  const std::string key = "crc32";
  const auto place = std::search(bytes_.begin(), bytes_.end(), key.begin(), key.end());
  ASSERT_NE(place, bytes_.end());
  Bytes damaged = bytes_;
  damaged[static_cast<std::size_t>(place - bytes_.begin())] ^= 1;
  for (const std::size_t length : {bytes_.size(), bytes_.size() / 2}) {
    damaged.resize(length);
    EXPECT_TRUE(content_of(damaged).refused) << length;
    const Content salvaged = content_of(damaged, {.salvage = true});
    EXPECT_FALSE(salvaged.refused) << length;
    EXPECT_TRUE(same(salvaged.info, {})) << length;
    EXPECT_NE(salvaged.loss.find("scene, seed and settings are damaged"), std::string::npos) << salvaged.loss;
  }
}

}  // namespace
}  // namespace prescene::service::recording_damage_laws_test
