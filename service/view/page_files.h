// SPDX-License-Identifier: Apache-2.0
// The page, as the build put it into the program.
#pragma once

#include <vector>

#include "prescene/interfaces/web/web_server.h"

namespace prescene::service {

std::vector<interfaces::WebFile> page_files();

}  // namespace prescene::service
