// SPDX-License-Identifier: Apache-2.0
// Of threads whose work may wait for that of others.
#pragma once

namespace prescene::core {

/// From now on the calling thread gets the processor after others that want it: nice 10, of this thread alone, as Linux
/// has it, or what it was where that is lower still. It can't be raised again. Without effect where the system refuses.
void lower_thread_priority();

}  // namespace prescene::core
