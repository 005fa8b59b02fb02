// SPDX-License-Identifier: Apache-2.0
#include <span>

#include "prescene/core/check.h"
#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/bytes/file.h"
#include "tests/support/paths.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

namespace {

void read_whole(const std::filesystem::path& path, bool salvage) {
  const auto reader = BagReader::open(path, {.salvage = salvage});
  if (!reader) {
    PRESCENE_CHECK(!reader.status().message().empty());
    return;
  }
  for (;;) {
    const auto message = (*reader)->next();
    if (!message) {
      PRESCENE_CHECK_MSG(!salvage && !message.status().message().empty(), message.status().message());
      return;
    }
    if (!*message) return;
    PRESCENE_CHECK((*message)->channel < static_cast<int>((*reader)->channels().size()));
    PRESCENE_CHECK((*message)->log_time_ns >= 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const prescene::tests::ScratchDir kFolder;
  const std::filesystem::path path = kFolder.path() / "bag.db3";
  auto file = OutputFile::create(path);
  PRESCENE_CHECK(file.ok() && file->write({data, size}).ok() && file->close().ok());
  read_whole(path, false);
  read_whole(path, true);
  return 0;
}
