// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/live take for granted.
#pragma once

#include "prescene/core/log.h"

namespace prescene::service::given_service_live {

extern const core::LogSink log;

}  // namespace prescene::service::given_service_live
