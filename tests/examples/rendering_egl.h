// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of rendering/egl take for granted.
#pragma once

#include <iostream>
