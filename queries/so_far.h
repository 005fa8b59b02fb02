// SPDX-License-Identifier: Apache-2.0
// Whoever wants to know what an answer is so far, while the work on it goes on.
#pragma once

#include <functional>

namespace prescene::queries {

/// Called from the thread that works; may be empty. What takes further instances, or a pass over all, is not in it yet.
template <class Answer>
using SoFarSink = std::function<void(Answer so_far)>;

}  // namespace prescene::queries
