// SPDX-License-Identifier: Apache-2.0
#include "tests/support/laws.h"

namespace prescene::tests {

bool check_law(const std::function<void(std::uint64_t)>& law) { return rc::check(law); }
bool check_law(const std::function<void()>& law) { return rc::check(law); }
bool check_law(const std::string& what, const std::function<void()>& law) { return rc::check(what, law); }

}  // namespace prescene::tests
