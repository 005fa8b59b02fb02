// SPDX-License-Identifier: Apache-2.0
// Counts this thread's uses of operator new.
#pragma once

namespace prescene::tests {

long allocation_count();

}  // namespace prescene::tests
