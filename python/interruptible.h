// SPDX-License-Identifier: Apache-2.0
// Long work for Python: without the GIL, so that other threads of Python go on, and ended by Ctrl-C.
//
// Used as interruptibly(cancellation, [&] { return queries::answer(scene, seed, query, context); }).
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <type_traits>

#include "prescene/core/progress.h"

namespace prescene::python {

/// Runs `work` on a thread of its own, without the GIL, and returns, with the GIL again, when it has ended. Handlers of
/// signals run meanwhile, some times a second. Where one raises, as that of Ctrl-C does, `cancellation` is requested,
/// and what it raised is thrown once the work has ended. Exceptions of the work are thrown too. RuntimeError in a
/// process that was forked from one that had worked already: it lacks the threads of its parent.
void run_interruptibly(core::Cancellation& cancellation, const std::function<void()>& work);

/// The same with what the work returns.
template <class Work>
std::invoke_result_t<Work> interruptibly(core::Cancellation& cancellation, const Work& work) {
  std::optional<std::invoke_result_t<Work>> result;
  run_interruptibly(cancellation, [&] { result.emplace(work()); });
  return *std::move(result);
}

/// Whether this process was forked from one that had worked: its objects can't end threads.
bool process_lacks_threads();

/// Calls body(begin, end) for blocks of [0, count), one after the other on the calling thread and without the GIL.
/// Between two blocks, but not more often than some times a second, handlers of signals run; what one raises is thrown.
void in_blocks(std::size_t count, std::size_t block, const std::function<void(std::size_t, std::size_t)>& body);

}  // namespace prescene::python
