// SPDX-License-Identifier: Apache-2.0
#include <span>

#include "prescene/core/check.h"
#include "prescene/interfaces/mcap/mcap_reader.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

namespace {

void read_whole(std::span<const std::uint8_t> bytes, const McapReaderOptions& options) {
  auto reader = McapReader::open_bytes({bytes.begin(), bytes.end()}, options);
  if (!reader) {
    PRESCENE_CHECK(!reader.status().message().empty());
    return;
  }
  for (;;) {
    const auto message = (*reader)->next();
    PRESCENE_CHECK_MSG(message.ok(), message.status().message());
    if (!*message) break;
    PRESCENE_CHECK((*message)->channel < static_cast<int>((*reader)->channels().size()));
    PRESCENE_CHECK((*message)->data.size() <= options.max_chunk_bytes);
  }
  PRESCENE_CHECK((*reader)->loss().text().empty() == (*reader)->loss().nothing());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read_whole({data, size}, {.max_chunk_bytes = 1 << 22});
  read_whole({data, size}, {.topics = {"/1"}, .begin_ns = 10, .end_ns = 100, .max_chunk_bytes = 1 << 16});
  return 0;
}
