// SPDX-License-Identifier: Apache-2.0
// Runs code of others, which may crash, hang or use up the memory, in a child process with limits. Nothing of what it
// does reaches this process but the bytes that it writes, and these are to be read like any bytes from outside.
//
//   const auto bytes = run_in_child([&](ChildOutput& out) { out.write(convert(file)); }, limits);
//   if (!bytes) return bytes.status().at("the converter");   // "...: did not finish within 8 s"
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/core/status.h"

namespace prescene::interfaces {

struct ChildLimits {
  /// Of address space, beyond what this process has mapped already. Not enforced in builds with the address or the
  /// thread sanitizer, which map far more than any limit (child_memory_is_limited()).
  std::size_t memory_bytes = std::size_t{800} << 20;
  std::chrono::milliseconds time{8000};  ///< By the wall clock; the processor's time is limited likewise.
  std::size_t output_bytes = std::size_t{256} << 20;
};

/// Where the child writes its result to. Ends the child when nobody listens any more.
class ChildOutput {
 public:
  explicit ChildOutput(int descriptor) : descriptor_(descriptor) {}
  void write(std::span<const std::uint8_t> bytes);

 private:
  int descriptor_;
};

/// What `work` wrote, once it has returned in the child. The child is a copy of this process with only the calling
/// thread; it has no open files, no standard input and output, writes no core file and ends with this process. `work`
/// must not need locks that other threads of this process may hold, except those of memory allocation. This process
/// has to leave the child to this function: SIGCHLD is not to be ignored (a program that is started by others may
/// inherit that), nor may others wait for just any child.
///
/// The status of a failure says what happened, as a sentence without its subject. kResourceExhausted: "ran out of its
/// 800.0 MiB of memory", "did not finish within 8 s", more output than the limit; kInvalidInput: "crashed (signal
/// 11)", threw, or ended otherwise; kCancelled, within a tenth of a second; kUnavailable: no process can be started, or
/// how it ended is unknown, since SIGCHLD is ignored or another waited for it.
core::Result<std::vector<std::uint8_t>> run_in_child(const std::function<void(ChildOutput&)>& work,
                                                     const ChildLimits& limits,
                                                     const core::Cancellation* cancellation = nullptr);

/// False in builds with the address or the thread sanitizer.
bool child_memory_is_limited();

}  // namespace prescene::interfaces
