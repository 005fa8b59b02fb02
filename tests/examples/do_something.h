// SPDX-License-Identifier: Apache-2.0
// What "..." in an example stands for.
#pragma once

namespace prescene {

template <typename... Values>
void do_something_with(const Values&... values);

}  // namespace prescene
