// SPDX-License-Identifier: Apache-2.0
// Any bytes as the metadata.yaml of a folder of rosbag2 with an MCAP file, a database and a file that is neither: the
// bag is opened and read, or refused with a reason. No file outside of the folder is ever one of it.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "prescene/core/check.h"
#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "tests/interfaces/bags/db3_files.h"
#include "tests/support/paths.h"

namespace {

using namespace prescene;              // NOLINT(google-build-using-namespace)
using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

/// bag/a.mcap, bag/b.db3 and bag/c.txt, and beside the folder out.mcap.
const std::filesystem::path& folder() {
  static const tests::ScratchDir kScratch;
  static const std::filesystem::path kFolder = [] {
    const std::filesystem::path bag = kScratch.path() / "bag";
    std::filesystem::create_directory(bag);
    for (const auto& path : {bag / "a.mcap", kScratch.path() / "out.mcap"}) {
      const auto writer = McapWriter::create(path, {});
      PRESCENE_CHECK(writer.ok());
      const auto channel = (*writer)->add_channel({"/a", "cdr", {"std_msgs/msg/String", "ros2msg", ""}, {}});
      PRESCENE_CHECK((*writer)->write({*channel, 0, 1, 1, {7}}).ok() && (*writer)->close().ok());
    }
    tests::write_db3(bag / "b.db3", {{"/b", "std_msgs/msg/String"}}, {{0, 5, {7}}});
    PRESCENE_CHECK(write_file(bag / "c.txt", std::string_view("neither")).ok());
    return bag;
  }();
  return kFolder;
}

void read_whole(bool salvage) {
  const auto reader = BagReader::open(folder(), {.salvage = salvage});
  if (!reader) {
    PRESCENE_CHECK(!reader.status().message().empty());
    return;
  }
  for (const std::filesystem::path& file : (*reader)->files())
    PRESCENE_CHECK(std::filesystem::weakly_canonical(file).parent_path() ==
                   std::filesystem::weakly_canonical(folder()));
  for (;;) {
    const auto message = (*reader)->next();
    PRESCENE_CHECK(message.ok() || !message.status().message().empty());
    if (!message || !*message) return;
    PRESCENE_CHECK((*message)->channel < static_cast<int>((*reader)->channels().size()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  PRESCENE_CHECK(write_file(folder() / "metadata.yaml", std::span(data, size)).ok());
  read_whole(false);
  read_whole(true);
  return 0;
}
