// SPDX-License-Identifier: Apache-2.0
#include "cyclone_log.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <dds/ddsrt/log.h>
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

struct Listening {
  const CycloneLog* owner;
  std::uint32_t domain;
  core::LogSink log;
};

/// Cyclone has one sink for the process.
struct AllListening {
  std::mutex changing;  // held while Cyclone is told, which waits for calls of its sink; not taken in these
  std::mutex mutex;     // guards the list; held while a sink is called, so that none is after its end
  std::vector<Listening> list;
};
AllListening& all_listening() {
  // Never destroyed: where nodes are still there when the process ends, Cyclone's threads may call the sink.
  static AllListening& all = *new AllListening;
  return all;
}

core::LogLevel level_of(std::uint32_t priority) {
  if ((priority & (DDS_LC_FATAL | DDS_LC_ERROR)) != 0) return core::LogLevel::kError;
  return (priority & DDS_LC_WARNING) != 0 ? core::LogLevel::kWarning : core::LogLevel::kInfo;
}

/// There may be bytes in it that a peer sent.
std::string line_of(std::string_view said) {
  return "Cyclone DDS: " + printable(said.substr(0, said.find_last_not_of(" \n") + 1));
}

void pass_on(const dds_log_data_t& said) {
  AllListening& all = all_listening();
  const std::lock_guard lock(all.mutex);
  if (all.list.empty()) return;
  const auto own =
      std::find_if(all.list.begin(), all.list.end(), [&](const Listening& one) { return one.domain == said.domid; });
  core::log((own != all.list.end() ? *own : all.list.front()).log, level_of(said.priority),
            line_of({said.message, said.size}));
}

void take_from_cyclone(void* /*unused*/, const dds_log_data_t* said) {
  // Cyclone ends the program after a fatal error, whose line a sink that limits its lines may hold back.
  if ((said->priority & DDS_LC_FATAL) != 0)
    std::fprintf(stderr, "Cyclone DDS: %.*s\n", static_cast<int>(said->size), said->message);
  // What a sink makes Cyclone say is not for a sink.
  thread_local bool is_inside = false;
  if (is_inside) return;
  is_inside = true;
  try {
    pass_on(*said);
  } catch (...) {  // no exception may pass through Cyclone; the line is lost
  }
  is_inside = false;
}

}  // namespace

CycloneLog::CycloneLog(int domain, core::LogSink log) {
  if (!log) return;
  AllListening& all = all_listening();
  const std::lock_guard changing(all.changing);
  bool is_first = false;
  {
    const std::lock_guard lock(all.mutex);
    is_first = all.list.empty();
    all.list.push_back({this, static_cast<std::uint32_t>(domain), std::move(log)});
  }
  if (is_first) dds_set_log_sink(take_from_cyclone, nullptr);
}

CycloneLog::~CycloneLog() {
  AllListening& all = all_listening();
  const std::lock_guard changing(all.changing);
  bool is_last = false;
  {
    const std::lock_guard lock(all.mutex);
    const std::size_t removed = std::erase_if(all.list, [&](const Listening& one) { return one.owner == this; });
    is_last = removed > 0 && all.list.empty();
  }
  if (is_last) dds_set_log_sink(nullptr, nullptr);
}

}  // namespace prescene::interfaces
