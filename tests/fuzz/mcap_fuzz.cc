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
    if (!message) {  // Only definitions that take too much memory end a salvage.
      PRESCENE_CHECK(!message.status().message().empty());
      const bool too_large = message.status().code() == prescene::core::StatusCode::kResourceExhausted;
      PRESCENE_CHECK_MSG(!options.salvage || too_large, message.status().message());
      return;
    }
    if (!*message) break;
    PRESCENE_CHECK((*message)->channel < static_cast<int>((*reader)->channels().size()));
    PRESCENE_CHECK((*message)->data.size() <= options.max_chunk_bytes);
  }
  PRESCENE_CHECK((*reader)->loss().text().empty() == (*reader)->loss().nothing());
  PRESCENE_CHECK((*reader)->unchecked().text().empty() == (*reader)->unchecked().nothing());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  read_whole({data, size}, {.max_chunk_bytes = 1 << 22});
  read_whole({data, size}, {.max_chunk_bytes = 1 << 22, .salvage = true});
  read_whole({data, size},
             {.topics = {"/1"}, .begin_ns = 10, .end_ns = 100, .max_chunk_bytes = 1 << 16, .salvage = true});
  return 0;
}
