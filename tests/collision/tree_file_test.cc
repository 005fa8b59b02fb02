// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_file_seal.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <thread>

#include "prescene/core/random.h"
#include "tests/support/paths.h"

namespace prescene::collision::tree_file_test {
namespace {

using core::StatusCode;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

struct Node {
  std::array<float, 6> box;
  std::uint32_t child;
  std::uint16_t count;
  std::uint16_t flags;

  friend bool operator==(const Node&, const Node&) = default;
};

constexpr TreeFileKey kKey{.kind = "boxes", .layout = 3, .mesh_hash = 0x1234567890abcdef, .settings_hash = 99};

struct Content {
  std::vector<Node> nodes;
  std::vector<std::uint32_t> triangles;
  std::vector<double> nothing;
  std::vector<std::uint8_t> bits;

  TreeFileWriter writer(const TreeFileKey& key = kKey) const {
    TreeFileWriter writer(key);
    writer.add(std::span<const Node>(nodes)).add(std::span<const std::uint32_t>(triangles));
    return writer.add(std::span<const double>(nothing)).add(std::span<const std::uint8_t>(bits));
  }
};

Content random_content(core::RandomStream& random, std::size_t most) {
  Content content;
  content.nodes.resize(random.uniform_below(most));
  for (Node& node : content.nodes) {
    for (float& f : node.box) f = std::bit_cast<float>(random.next_u32() & 0x7f7fffffU);
    node.child = random.next_u32();
    node.count = static_cast<std::uint16_t>(random.next_u32());
    node.flags = 0xffff;
  }
  content.triangles.resize(random.uniform_below(most));
  for (std::uint32_t& t : content.triangles) t = random.next_u32();
  content.bits.resize(random.uniform_below(most));
  for (std::uint8_t& b : content.bits) b = static_cast<std::uint8_t>(random.next_u32());
  return content;
}

template <class T>
void expect_section(const TreeFile& file, std::size_t i, const std::vector<T>& expected) {
  const auto section = file.section<T>(i);
  ASSERT_TRUE(section.ok()) << section.status().message();
  ASSERT_EQ(section->size(), expected.size());
  const auto bytes = [](std::span<const T> values) { return std::as_bytes(values); };
  EXPECT_TRUE(std::ranges::equal(bytes(section->span()), bytes(expected)));
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(section->data()) % kTreeFileAlignment, 0U);
}

void expect_content(const TreeFile& file, const Content& content) {
  ASSERT_EQ(file.section_count(), 4U);
  expect_section(file, 0, content.nodes);
  expect_section(file, 1, content.triangles);
  expect_section(file, 2, content.nothing);
  expect_section(file, 3, content.bits);
}

std::string refusal(std::span<const std::uint8_t> bytes, const TreeFileKey& key = kKey) {
  const auto file = TreeFile::from_bytes(bytes, key, "cup.tree");
  if (file.ok()) return "accepted";
  EXPECT_THAT(file.status().message(),
              AllOf(HasSubstr("cup.tree: "), AnyOf(HasSubstr("build the tree anew"), HasSubstr("name the file"))));
  return file.status().message();
}

TEST(TreeFile, ComesBackBitForBit) {
  const tests::ScratchDir dir;
  core::RandomStream random(1, core::Purpose::kTest);
  for (int i = 0; i < 30; ++i) {
    const Content content = random_content(random, i < 15 ? 4 : 3000);
    const auto path = dir.path() / "a.tree";
    ASSERT_TRUE(content.writer().write(path).ok());
    const auto file = TreeFile::open(path, kKey);
    ASSERT_TRUE(file.ok()) << file.status().message();
    expect_content(*file, content);
    const auto bytes = content.writer().bytes();
    EXPECT_EQ(std::filesystem::file_size(path), bytes.size());
    const auto copy = TreeFile::from_bytes(bytes, kKey, "copy");
    ASSERT_TRUE(copy.ok()) << copy.status().message();
    expect_content(*copy, content);
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1) << "a partial file was left";
}

TEST(TreeFile, SectionsOutliveTheFileItsNameAndItsReplacement) {
  const tests::ScratchDir dir;
  core::RandomStream random(2, core::Purpose::kTest);
  const Content content = random_content(random, 5000);
  const auto path = dir.path() / "a.tree";
  ASSERT_TRUE(content.writer().write(path).ok());
  std::optional<Array<std::uint32_t>> triangles;
  {
    const auto file = TreeFile::open(path, kKey);
    ASSERT_TRUE(file.ok());
    triangles = *file->section<std::uint32_t>(1);
  }
  ASSERT_TRUE(random_content(random, 10).writer().write(path).ok());
  std::filesystem::remove(path);
  EXPECT_TRUE(std::equal(triangles->begin(), triangles->end(), content.triangles.begin(), content.triangles.end()));
}

TEST(TreeFile, RefusesEachDamagedByteAndEachCut) {
  core::RandomStream random(3, core::Purpose::kTest);
  const std::vector<std::uint8_t> sound = random_content(random, 20).writer().bytes();
  ASSERT_EQ(refusal(sound), "accepted");
  std::vector<std::uint8_t> bytes = sound;
  for (std::size_t i = 0; i < sound.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xff}) {
      bytes[i] = static_cast<std::uint8_t>(sound[i] ^ flip);
      ASSERT_NE(refusal(bytes), "accepted") << "byte " << i;
    }
    bytes[i] = sound[i];
    ASSERT_NE(refusal(std::span(sound).first(i)), "accepted") << "cut at " << i;
  }
  bytes.resize(sound.size() + 64);
  EXPECT_THAT(refusal(bytes), HasSubstr("bytes instead of"));
}

TEST(TreeFile, SaysWhyAFileIsRefused) {
  core::RandomStream random(4, core::Purpose::kTest);
  const std::vector<std::uint8_t> sound = random_content(random, 20).writer().bytes();
  EXPECT_THAT(refusal({}), HasSubstr("not a tree file"));
  std::vector<std::uint8_t> bytes = sound;
  bytes[0] = 'X';
  EXPECT_THAT(refusal(bytes), HasSubstr("not a tree file"));
  bytes = sound;
  bytes[8] = 7;
  EXPECT_THAT(refusal(bytes), HasSubstr("format 7, this version reads format 1"));
  bytes = sound;
  bytes[200] ^= 1;
  EXPECT_THAT(refusal(bytes), HasSubstr("checksum"));
  EXPECT_THAT(refusal(std::span(sound).first(100)), HasSubstr("100 bytes instead of"));
  EXPECT_THAT(refusal(std::span(sound).first(20)), HasSubstr("cut short"));

  TreeFileKey other = kKey;
  other.kind = "spheres";
  EXPECT_THAT(refusal(sound, other), HasSubstr("a tree of kind 'boxes' instead of 'spheres'"));
  other = kKey;
  other.layout = 4;
  EXPECT_THAT(refusal(sound, other), HasSubstr("version 3 of its kind of tree, not 4"));
  other = kKey;
  other.mesh_hash += 1;
  EXPECT_THAT(refusal(sound, other), HasSubstr("another mesh"));
  other = kKey;
  other.settings_hash += 1;
  EXPECT_THAT(refusal(sound, other), HasSubstr("other settings"));

  const auto file = TreeFile::from_bytes(sound, kKey, "cup.tree");
  ASSERT_TRUE(file.ok());
  EXPECT_THAT(file->section<float>(4).status().message(), HasSubstr("section 4 is missing: there are 4"));
  EXPECT_THAT(file->section<float>(0).status().message(), HasSubstr("values of 32 bytes instead of 4"));
}

// The header has 16 bytes for the kind, the last of which is zero. A longer kind is a bug of the caller, on both sides.
TEST(TreeFile, AbortsForAKindThatTheHeaderCannotHold) {
  const tests::ScratchDir dir;
  core::RandomStream random(8, core::Purpose::kTest);
  const Content content = random_content(random, 20);
  TreeFileKey key = kKey;
  const std::string longest(15, 'k');
  key.kind = longest;
  const std::vector<std::uint8_t> bytes = content.writer(key).bytes();
  EXPECT_EQ(refusal(bytes, key), "accepted");
  const auto path = dir.path() / "a.tree";
  ASSERT_TRUE(content.writer(key).write(path).ok());
  for (const std::string& kind : {std::string(), std::string(16, 'k'), std::string(17, 'k'), std::string(4096, 'k')}) {
    key.kind = kind;
    EXPECT_DEATH(content.writer(key), "1 to 15 characters");
    EXPECT_DEATH(static_cast<void>(TreeFile::from_bytes(bytes, key, "cup.tree")), "1 to 15 characters");
    EXPECT_DEATH(static_cast<void>(TreeFile::open(path, key)), "1 to 15 characters");
  }
}

// With the checksum made right: what a program with other ideas, or an attacker, might write.
TEST(TreeFile, TrustsNoNumberBehindARightChecksum) {
  core::RandomStream random(5, core::Purpose::kTest);
  Content content = random_content(random, 20);
  content.nodes.resize(7);
  const std::vector<std::uint8_t> sound = content.writer().bytes();
  const auto with = [&sound](std::size_t offset, std::uint64_t value) {
    std::vector<std::uint8_t> bytes = sound;
    std::memcpy(bytes.data() + offset, &value, sizeof value);
    seal_tree_file(bytes);
    return bytes;
  };
  constexpr std::size_t kCount = 64;
  constexpr std::size_t kFirst = 96;  // offset, count, element size
  for (const std::uint64_t count : {std::uint64_t{63}, std::uint64_t{1} << 59U, ~std::uint64_t{0}})
    EXPECT_THAT(refusal(with(kCount, count)), HasSubstr("sections"));
  for (const std::uint64_t offset : {std::uint64_t{0}, std::uint64_t{64}, std::uint64_t{257}, std::uint64_t{1} << 62U})
    EXPECT_THAT(refusal(with(kFirst, offset)), HasSubstr("section 0 is out of place"));
  for (const std::uint64_t count : {std::uint64_t{sound.size()}, std::uint64_t{1} << 59U, ~std::uint64_t{0}})
    EXPECT_THAT(refusal(with(kFirst + 8, count)), HasSubstr("section 0 is out of place"));
  EXPECT_THAT(refusal(with(kFirst + 16, 0)), HasSubstr("section 0 is out of place"));
  // The second section begins within the first.
  std::uint64_t first = 0;
  std::memcpy(&first, sound.data() + kFirst, sizeof first);
  EXPECT_THAT(refusal(with(kFirst + 32, first)), HasSubstr("section 1 is out of place"));
}

TEST(TreeFile, NamesWhatTheFileSystemRefuses) {
  const tests::ScratchDir dir;
  const Content content;
  EXPECT_EQ(TreeFile::open(dir.path() / "none", kKey).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(TreeFile::open(dir.path(), kKey).status().code(), StatusCode::kInvalidInput);
  const auto pipe = dir.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(TreeFile::open(pipe, kKey).status().code(), StatusCode::kInvalidInput) << "must not block";
  std::ofstream(dir.path() / "empty").close();
  EXPECT_THAT(TreeFile::open(dir.path() / "empty", kKey).status().message(), HasSubstr("not a tree file"));

  const auto no_folder = content.writer().write(dir.path() / "no" / "a.tree");
  EXPECT_EQ(no_folder.code(), StatusCode::kNotFound);
  EXPECT_THAT(no_folder.message(), HasSubstr("folder does not exist"));
  EXPECT_FALSE(content.writer().write(dir.path()).ok()) << "a folder is in the way";
  std::ofstream(dir.path() / "file").close();
  EXPECT_THAT(content.writer().write(dir.path() / "file" / "a.tree").message(), HasSubstr("its folder is a file"));
}

TEST(TreeFile, LeavesInPlaceWhatIsNoFile) {
  const tests::ScratchDir dir;
  const Content content;
  const auto pipe = dir.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(content.writer().write(pipe).code(), StatusCode::kInvalidInput);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));

  const auto target = dir.path() / "target.tree";
  const auto link = dir.path() / "link.tree";
  ASSERT_TRUE(content.writer().write(target).ok());
  std::filesystem::create_symlink("target.tree", link);
  core::RandomStream random(4, core::Purpose::kTest);
  const Content other = random_content(random, 100);
  ASSERT_TRUE(other.writer().write(link).ok());
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(std::filesystem::file_size(target), other.writer().bytes().size());

  // As long as a name may be.
  const auto long_name = dir.path() / std::string(255, 'a');
  EXPECT_TRUE(content.writer().write(long_name).ok());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 4) << "a partial file was left";
}

TEST(TreeFile, WritersOfOneFileDoNotMix) {
  const tests::ScratchDir dir;
  const auto path = dir.path() / "a.tree";
  core::RandomStream random(6, core::Purpose::kTest);
  const std::array<Content, 2> contents = {random_content(random, 2000), random_content(random, 2000)};
  ASSERT_TRUE(contents[0].writer().write(path).ok());
  std::vector<std::jthread> writers;
  for (const Content& content : contents) {
    writers.emplace_back([&content, &path] {
      for (int i = 0; i < 20; ++i) EXPECT_TRUE(content.writer().write(path).ok());
    });
  }
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(TreeFile::open(path, kKey).ok());
  writers.clear();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1);
}

}  // namespace
}  // namespace prescene::collision::tree_file_test
