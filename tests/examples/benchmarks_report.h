// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of benchmarks/report.h take for granted.
#pragma once

#include <cstdio>
