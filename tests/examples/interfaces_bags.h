// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/bags take for granted.
#pragma once

namespace prescene::interfaces::given_interfaces_bags {}
